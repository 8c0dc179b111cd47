#!/bin/sh
# gcodeparser 0.3.0 (reads programs of machines and printers in G-code): a code with a decimal loses it, and with it all its words: "G92.1", which ends an offset, is read as "G92" without words, which in many machines makes the present place the
# origin; "G38.2 Z-10 F50", which moves down to a probe, as "G38" without a goal; "G90.1 X5" as "G90". A line of coordinates alone, which repeats the move before it (modal, as nearly all machines' programs are written), is left out, and of a comment
# in parentheses the words are executed: "(before: G0 Z-5)" is a move by 5 mm into the table. gcode_str writes that back. There is no error and no warning, and no way to see what was lost. Of six valid lines of a mill, one comes back as it was.
# The package is of printers first, but says "a simple gcode parser"; pygcode, of the same lines, keeps codes, words and comments.
# Seen on 2026-12-01:  G92.1 -> G92   G38.2 Z-10 F50 -> G38   G54.1 P2 -> G54   X20 Y5 -> nothing   (before: G0 Z-5) -> G0 Z-5   G1 X10 Y5 -> G1 X10 Y5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q gcodeparser==0.3.0 pygcode==0.2.1
cat > run.py <<'PY'
import gcodeparser
import pygcode

expected = {
    "G1 X10 Y5": ["G1 X10 Y5"],
    "X20 Y5": [],
    "G92.1": ["G92"],
    "G38.2 Z-10 F50": ["G38"],
    "G54.1 P2": ["G54"],
    "(before: G0 Z-5)": ["G0 Z-5"],
}
program = "\n".join(expected)
lines = list(gcodeparser.parse_gcode_lines(program, include_comments=True))
for number, (text, seen) in enumerate(expected.items()):
    read = [line.gcode_str for line in lines if line.line_index == number]
    other = pygcode.Line(text)
    print(f"SEEN {text!r}: gcodeparser {read}, pygcode: words {[str(word) for word in other.block.words]}, comment {str(other.comment or '')!r}")
    assert read == seen
assert [str(word) for word in pygcode.Line("G38.2 Z-10 F50").block.words] == ["G38.2", "Z-10", "F50"]
assert not pygcode.Line("(before: G0 Z-5)").block.words
PY
v/bin/python run.py
