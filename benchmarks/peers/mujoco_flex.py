"""MuJoCo's flex: tetrahedra under a St. Venant-Kirchhoff law, double precision, contact off."""

import mujoco

from .protocol import PeerBody, PeerStepper


def mujoco_flex(body: PeerBody, case: str) -> PeerStepper:
    """Return the body as a flex, ready to step.

    Args:
        body: What to simulate.
        case: INTEGRATOR:DAMPING.
    """
    integrator, damping = case.split(":")
    seconds = body.retardation_time if damping == "damped" else 0.0
    model = mujoco.MjModel.from_xml_string(_xml(body, integrator, seconds))
    data = mujoco.MjData(model)

    def steps(n: int) -> None:
        mujoco.mj_step(model, data, nstep=n)

    return PeerStepper(steps, lambda: data.flexvert_xpos, mujoco.__version__)


def _xml(body: PeerBody, integrator: str, damping: float) -> str:
    """Return the model in MJCF: one flex with pinned vertices, and nothing to collide with."""
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
