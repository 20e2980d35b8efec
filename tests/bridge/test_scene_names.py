import pytest

from bridge.device.messages import (
    DeviceDescription,
    pack_device_description,
    unpack_device_description,
)
from bridge.link import InProcessLink
from bridge.tcp.messages.text import (
    is_scene_name,
    pack_description,
    sent_scene_name,
    unpack_description,
)
from bridge.tcp.wire import MessageError
from tests.bridge.tcp.serve_block import block_tissue

PATHS = ["", "..", "../../.ssh", "/etc", "C:\\x", "a/b", "a.b", "a b", "a\n", "\x1b[31m", "ä"]
TOO_LONG = 65 * "x"


@pytest.mark.parametrize("name", ["organ", "grid2", "my_liver-2", "x" * 64])
def test_a_name_of_letters_digits_underscores_and_dashes_is_sent_as_it_is(name):
    assert is_scene_name(name)
    assert sent_scene_name(name) == name


@pytest.mark.parametrize("name", [*PATHS, TOO_LONG])
def test_any_other_name_is_sent_without_what_could_be_a_path(name):
    assert not is_scene_name(name)
    assert is_scene_name(sent_scene_name(name))


@pytest.mark.parametrize("name", [*PATHS, TOO_LONG])
def test_a_client_refuses_another_name_of_a_server(name):
    description = InProcessLink(block_tissue(), name).describe()
    with pytest.raises(MessageError, match=r"the tissue's scene is .* wanted 1 to 64 letters"):
        unpack_description(pack_description(description))


@pytest.mark.parametrize("name", [*PATHS, TOO_LONG])
def test_a_device_refuses_another_name_of_a_run(name):
    description = DeviceDescription(name, 0.04, 0.2, 2.0)
    with pytest.raises(MessageError, match=r"the run's scene is .* wanted 1 to 64 letters"):
        unpack_device_description(pack_device_description(description))
