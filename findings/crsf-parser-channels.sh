#!/bin/sh
# crsf-parser 0.3.2, construct 2.10.70 (frames of a CRSF receiver, the remote control of a robot): the channels come in reverse: payload.channels[0] is the frame's channel 16 and channels[15] its channel 1, as the package swaps all 22 bytes
# and then reads from the top. CRSF packs 16 numbers of 11 bits, the first channel in the lowest bits. Throttle (channel 3) is read at place 13, and an arm switch on channel 5 at place 11: what a caller takes for
# the throttle is an auxiliary switch. crsf_build_frame() reverses too, so that a test of both sees nothing, and a flight controller gets the channels in reverse. There is no error.
# Seen on 2026-11-30:  channels 1 to 16 = 201 to 216: channels[0:3] = 216, 215, 214, channels[15] = 201, frame valid   built from 201 to 216: first channel on the wire 216
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps crsf-parser==0.3.2 construct==2.10.70
cat > run.py <<'PY'
from crsf_parser import CRSFParser, PacketValidationStatus
from crsf_parser.handling import crsf_build_frame, crsf_frame_crc
from crsf_parser.payloads import PacketsTypes

values = list(range(201, 217))
packed = sum(value << 11 * place for place, value in enumerate(values)).to_bytes(22, "little")
frame = bytearray(b"\xc8\x18\x16" + packed + b"\x00")
frame[-1] = crsf_frame_crc(frame)
frames = []
CRSFParser(lambda content, status: frames.append((content, status))).parse_stream(bytearray(frame))
(content, status), = frames
read = [int(value) for value in content.payload.channels]
built = crsf_build_frame(PacketsTypes.RC_CHANNELS_PACKED, {"channels": values})
wire = int.from_bytes(built[3:25], "little")
sent = [wire >> 11 * place & 0x7FF for place in range(16)]
print("SEEN", status, "sent 1 to 16:", values, "read:", read, "built:", sent)
assert status == PacketValidationStatus.VALID
assert read == values[::-1] and sent == values[::-1]
PY
v/bin/python run.py
