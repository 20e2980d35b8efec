"""Read all that a step says of the forces: wrench, stiffness, contacts, and where the work went."""

from scalpel_sim import SCALPEL, SCENES, changed, prepare

simulation = prepare(changed(SCENES["slab"], blade=SCALPEL, audit=True))
simulation.run(seconds=0.6)
result = simulation.result
wrench, contacts, energies = result.wrench_t1, result.contacts, result.energies

print("force", wrench.force, "N, torque", wrench.torque, "N m about", wrench.point)
print("stiffness", result.stiffness.diagonal(), "N/m and N m/rad")
print(f"{len(contacts.point)} contacts press with {contacts.normal_force.sum():.2f} N")
print(f"cutting took {energies.cutting / energies.work_of_blade:.0%} of the work")
print(f"not accounted for: {energies.residual / energies.work_of_blade:.3%}")
