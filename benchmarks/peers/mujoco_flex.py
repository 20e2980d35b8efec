"""MuJoCo's flex: tetrahedra of its own law, double precision, contact off."""

import mujoco
from protocol import Body, Stepper, main


def make(body: Body, case: str) -> Stepper:
    """Return the body as a flex; `case` is INTEGRATOR:DAMPING."""
    integrator, damping = case.split(":")
    seconds = body.retardation_time if damping == "damped" else 0.0
    model = mujoco.MjModel.from_xml_string(xml_of(body, integrator, seconds))
    data = mujoco.MjData(model)

    def steps(n: int) -> None:
        mujoco.mj_step(model, data, nstep=n)

    return Stepper(steps, lambda: data.flexvert_xpos, mujoco.__version__)


def xml_of(body: Body, integrator: str, damping: float) -> str:
    """Return the model: one flex between held vertices, and nothing to collide with."""
    points = " ".join(f"{x:.9g}" for x in body.positions.ravel())
    elements = " ".join(map(str, body.tetrahedra.ravel()))
    held = " ".join(map(str, body.held))
    return f"""
    <mujoco>
      <option timestep="{body.dt}" integrator="{integrator}"><flag contact="disable"/></option>
      <worldbody>
        <flexcomp name="block" type="direct" dim="3" mass="{body.masses.sum():.9g}"
                  point="{points}" element="{elements}" radius="1e-4">
          <edge equality="false"/>
          <contact selfcollide="none" contype="0" conaffinity="0"/>
          <elasticity young="{body.young_modulus}" poisson="{body.poisson_ratio}"
                      damping="{damping}"/>
          <pin id="{held}"/>
        </flexcomp>
      </worldbody>
    </mujoco>"""


if __name__ == "__main__":
    main(make)
