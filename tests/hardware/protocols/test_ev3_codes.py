import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import CODES, Instruction, Variable, decode, encode, encode_argument

CONSTANTS = {
    0: "00", 31: "1F", -1: "3F", -31: "21", -32: "20", 32: "81 20", -33: "81 DF", 127: "81 7F", -127: "81 81",
    128: "82 80 00", 300: "82 2C 01", 360: "82 68 01", 32768: "83 00 80 00 00",
}  # fmt: skip
ARGUMENTS = st.one_of(
    st.integers(-0x80000000, 0x7FFFFFFF),
    st.builds(Variable, st.integers(0, 0x7FFF), st.booleans()),
    st.text(st.characters(min_codepoint=1, max_codepoint=255), max_size=20),
)


@st.composite
def instructions(draw: st.DrawFn) -> Instruction:
    name = draw(st.sampled_from(sorted(CODES)))
    arguments = [draw(ARGUMENTS) for _ in range(CODES[name].parameters)]
    if CODES[name].counted:
        arguments[-1] = draw(st.integers(0, 5))
        arguments += [draw(ARGUMENTS) for _ in range(arguments[-1])]
    return Instruction(name, tuple(arguments))


@pytest.mark.parametrize(("value", "expected"), CONSTANTS.items())
def test_constants_have_the_shortest_form_of_the_firmware(value, expected):
    assert encode_argument(value) == bytes.fromhex(expected)


@pytest.mark.parametrize(("offset", "expected"), [(0, "60"), (4, "64"), (31, "7F"), (32, "E1 20"), (200, "E1 C8"), (300, "E2 2C 01")])
def test_places_in_the_reply_have_the_form_of_the_firmware(offset, expected):
    assert encode_argument(Variable(offset)) == bytes.fromhex(expected)


@given(st.lists(instructions(), max_size=6))
def test_what_is_encoded_is_decoded_again(program):
    assert decode(encode(*program)) == program


def test_no_two_instructions_share_their_bytes():
    assert len({code.opcode for code in CODES.values()}) == len(CODES)


@pytest.mark.parametrize(
    ("instruction", "words"),
    [
        (Instruction("FLY"), "no instruction 'FLY'"),
        (Instruction("OUTPUT_STOP", (0, 1)), "takes 3 arguments, got 2"),
        (Instruction("OUTPUT_START", (0, 1 << 31)), "32 bits"),
        (Instruction("OUTPUT_GET_COUNT", (0, 0, Variable(-1))), "within 0 and 32767"),
        (Instruction("UI_WRITE_LED", ("a\0b",)), "cannot hold a zero"),
    ],
)
def test_what_the_brick_cannot_be_told_is_an_error_of_one_line(instruction, words):
    with pytest.raises(ProtocolError, match=words):
        encode(instruction)


@pytest.mark.parametrize("codes", ["FF", "A5 00", "99", "99 FF", "A6 00 84 41", "A6 85 00", "A6 83 01", "99 1D 00 00 00 00 60"])
def test_broken_codes_are_an_error(codes):
    with pytest.raises(ProtocolError):
        decode(bytes.fromhex(codes))


@given(st.binary(max_size=60))
def test_any_bytes_are_understood_or_refused(codes):
    with contextlib.suppress(ProtocolError):
        decode(codes)
