"""Contacts as springs with friction.

In the order in which they are best read:

    contacts           the contacts, and how one continues with the force of another
    forces             their forces in every evaluation, and their work after a substep
    torque_balance     forces act so that they and their reactions turn nothing
    stiffness          stiffness by mass splitting, and offsets by which forces continue
"""
