import stat

import pytest

from bridge.tcp.keys import KEY_VARIABLE, NEW_KEY_BYTES, chosen_key, read_key, write_new_key

KEY = "0123456789abcdef" * 4


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "link.key"
    path.write_text(KEY + "\n")
    path.chmod(0o600)
    return path


def test_a_new_key_is_random_and_for_its_owner_alone(tmp_path):
    for name in ("first", "second"):
        write_new_key(tmp_path / name)
    first, second = read_key(tmp_path / "first"), read_key(tmp_path / "second")
    assert len(first) == NEW_KEY_BYTES and first != second
    assert stat.S_IMODE((tmp_path / "first").stat().st_mode) == 0o600


def test_an_existing_key_file_is_never_overwritten(file):
    with pytest.raises(ValueError, match="exists already"):
        write_new_key(file)
    assert read_key(file) == bytes.fromhex(KEY)


def test_the_file_has_priority_over_the_environment_and_both_are_optional(file, monkeypatch):
    monkeypatch.delenv(KEY_VARIABLE, raising=False)
    assert chosen_key(None) is None
    monkeypatch.setenv(KEY_VARIABLE, "ab" * 16)
    assert chosen_key(None) == b"\xab" * 16
    assert chosen_key(file) == bytes.fromhex(KEY)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "0 bytes; wanted at least 16"),
        ("ab" * 15, "15 bytes; wanted at least 16"),
        ("correct horse battery staple", "holds no key: wanted hexadecimal"),
        ("ab" * 16 + "c", "holds no key"),
        ("\xff" * 32, "holds no key"),
    ],
)
def test_a_short_or_malformed_key_is_refused_and_not_repeated(file, monkeypatch, text, why):
    file.write_text(text, encoding="latin-1")
    monkeypatch.setenv(KEY_VARIABLE, text)
    for path in (file, None):
        with pytest.raises(ValueError, match=why) as refused:
            chosen_key(path)
        assert not text or text not in str(refused.value)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o666])
def test_a_key_that_others_can_read_is_refused(file, mode):
    file.chmod(mode)
    with pytest.raises(ValueError, match=r"open to other users .* chmod 600"):
        read_key(file)


def test_a_missing_key_file_is_one_clear_error(tmp_path):
    for path in (tmp_path / "none", tmp_path):
        with pytest.raises(ValueError, match=r"cannot be read: .*scalpel-sim key"):
            read_key(path)
