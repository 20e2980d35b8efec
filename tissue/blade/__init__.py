"""The blade in the tissue: its edge, which cuts, and its other sides, which press and rub.

In reading order:

- `edge`: the cutting edge over a step, and the pose of the blade at an instant.
- `toughness`: the energy that cutting takes, per area.
- `impulse_totals`: impulses and works that blade and tissue exchanged.
- `coarse_hold`: what a tetrahedron that was cut still holds of the anchors.
- `anchors`: the springs between edge and material, and their energy.
- `side_contact`: the law of pressure and friction on the side faces.
- `blunt_contact`: the law of pressure, friction and piercing at the back and the ends.
- `blade_state`: all that blade and tissue remember of each other.
- `edge_forces`: forces of the edge on the nodes.
- `side_forces`: forces of the side faces on the nodes, and sliding.
- `material_frame`: vectors mapped to the body at rest.
- `rest_area`: the area at rest that an anchor cuts, for the area that it sweeps.
- `return_mapping`: plastic slip of the anchors.
- `engagement`: which samples of the edge are anchored.
- `side_search`: which faces of the tissue are near the blade.
- `blunt_search`: which skin is in the way of the back and the ends.
- `blunt_forces`: forces of the back and the ends on the nodes, sliding and piercing.
- `forces`: what an integrator calls.
- `blade_mass`: mass for light nodes on the edge.
- `path_tracing`: the path of the edge through the material, from the anchors.
- `prescribed_path`: the path of an edge that is given.
- `wrench`: the wrench on the blade.
- `lazy_result`: the result of a step, whose arrays are made when they are asked for.
- `blade_context`: what `BladeInteraction` calls, on one struct.
- `interaction`: `BladeInteraction`, which `Tissue` calls.
"""
