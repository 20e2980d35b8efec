"""The blade in the tissue: its edge cuts, its faces and its spine press and rub.

The spine is the back and the two ends, which are blunt.

In reading order:

- `edge`: the cutting edge over a step, the pose of the blade at an instant, and checks of both.
- `toughness`: the energy that cutting takes, per area.
- `coarse_hold`: the hold of the anchors in a tetrahedron that was cut.
- `body_sheets`: the sheets of tissue that the edge is in.
- `edge_anchors`, `faces_contact`, `spine_contact`: springs or pressure of each part, and energy.
- `blade_state`: the memory of blade and tissue, and the impulses and works that they exchanged.
- `edge_search`, `faces_search`, `spine_search`: the tissue that each part meets.
- `edge_forces`, `faces_forces`, `spine_forces`: its forces on the nodes, and its stiffness.
- `material_frame`: vectors mapped to the body at rest.
- `return_mapping`: plastic slip of the anchors.
- `forces`: the list of all of these, for an integrator.
- `path_tracing`: the path of the edge through the material, from the anchors.
- `wrench`: the wrench on the blade.
- `blade_context`: the stages of a step on one struct, and the result of the step.
- `interaction`: `BladeInteraction`, the owner of all of these.
- `prescribed_cut`: a cut along a given surface, without a blade.
"""
