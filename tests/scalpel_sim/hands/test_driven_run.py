"""`scalpel-sim view --hand live`, led by a page without a browser."""

import asyncio
import json
import signal

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import FINAL, FORCES, STROKE, SUMMARY
from scalpel_sim.runs.run import REST_AFTER_STROKE
from tests.scalpel_sim.hands.driven_view import DrivenView, page_of, token_in

pytestmark = pytest.mark.end_to_end

SECONDS = 0.4
"""How long the hand leads [s]."""

N_FORCES = shared_columns().index("cut_area_m2")
"""Columns of time, tip and forces, which come first."""


async def lead(view):
    """Engage the hand, and move it forwards until the run has ended."""
    page = await page_of(view.url, view.url.rstrip("/"), token_in(view.url))
    await page.write_message('{"type":"engage"}')
    files = asyncio.create_task(asyncio.to_thread(view.wait_for_files))
    while not files.done():
        await page.write_message('{"type":"move","by":[0,0.002,0],"stamp":1}')
        await asyncio.sleep(0.03)
    await files


async def lead_until(view, stroke, n_rows):
    """Engage the hand, and move it forwards until so many rows of what it did are written."""
    page = await page_of(view.url, view.url.rstrip("/"), token_in(view.url))
    await page.write_message('{"type":"engage"}')
    while not stroke.exists() or len(stroke.read_text().splitlines()) < n_rows:
        await page.write_message('{"type":"move","by":[0,0.001,0],"stamp":1}')
        await asyncio.sleep(0.03)


def test_a_stroke_that_was_led_for_some_seconds_is_repeated_by_name_to_the_bit(tmp_path):
    led, again = tmp_path / "led", tmp_path / "again"
    with DrivenView("grid2", led, "--seconds", str(SECONDS)) as view:
        asyncio.run(lead(view))
    summary = json.loads((led / SUMMARY).read_text())
    assert summary["status"] == "complete"
    assert summary["simulated_seconds"] == pytest.approx(SECONDS + REST_AFTER_STROKE)
    stroke = ["--relaxation", "verlet", "--stroke", str(led / STROKE)]
    assert command_line(["run", "grid2", *stroke, "-q", "--out", str(again)]) == 0
    assert (led / FINAL).read_bytes() == (again / FINAL).read_bytes()
    rows = [read_forces(folder / FORCES).rows[:, :N_FORCES] for folder in (led, again)]
    assert np.ptp(rows[0][:, shared_columns().index("tip_y_m")]) > 0.005
    assert np.array_equal(*rows)


def test_a_led_run_that_was_killed_goes_on_as_a_run_of_what_the_hand_had_done(tmp_path):
    led, again = tmp_path / "led", tmp_path / "again"
    with DrivenView("grid2", led, "--checkpoint", "0.1") as view:
        asyncio.run(lead_until(view, led / STROKE, n_rows=300))
        view.process.kill()
    assert not (led / FINAL).exists()
    assert command_line(["run", "--resume", str(led), "-q"]) == 0
    summary = json.loads((led / SUMMARY).read_text())
    assert summary["status"] == "complete"
    stroke = ["--relaxation", "verlet", "--stroke", str(led / STROKE)]
    assert command_line(["run", "grid2", *stroke, "-q", "--out", str(again)]) == 0
    assert (led / FINAL).read_bytes() == (again / FINAL).read_bytes()
    assert summary["simulated_seconds"] == pytest.approx(
        json.loads((again / SUMMARY).read_text())["simulated_seconds"]
    )


def test_an_interrupted_run_that_waits_for_a_hand_ends(tmp_path):
    with DrivenView("grid2", tmp_path) as view:
        view.process.send_signal(signal.SIGINT)
        view.line_with("interrupted")
        assert view.process.wait(timeout=30) == 1
