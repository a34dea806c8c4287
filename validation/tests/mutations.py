"""Small mistakes in text files, by a seed: what a user types wrong, and what a disk loses."""
import random
import re

VALUES = ['"text"', '""', "true", "[]", "{}", "-1", "0", "nan", "inf", "1e400", "2027-06-01", "[1, \"a\"]", "[[1]]", '"3 parsecs"', "9" * 30, "1.5",
          '["nobody"]', "{ a = 1 }", "'two'"]


def _lines(change):
    def apply(text, chance):
        lines = text.split("\n")
        k = chance.choice([k for k, line in enumerate(lines) if line.strip()])
        change(lines, k, chance)
        return "\n".join(lines)
    return apply


def _value(lines, k, chance):
    """Another value for a key, in TOML and JSON."""
    found = re.match(r'(\s*"?[\w.-]+"?\s*[=:]\s*)(.+?)(,?)$', lines[k])
    lines[k] = found[1] + chance.choice(VALUES) + found[3] if found else chance.choice(VALUES)


def _key(lines, k, chance):
    """A misspelled key."""
    at = chance.randrange(1, max(2, len(re.match(r'\s*"?[\w.]*', lines[k])[0]) + 1))
    lines[k] = lines[k][:at] + chance.choice("xqz_") + lines[k][at:]


def _cell(lines, k, chance):
    """Another cell of a table of values."""
    cells = lines[k].split(",")
    cells[chance.randrange(len(cells))] = chance.choice(["", "nan", "inf", "x", "1e400", "-3", "0x10", "1 2", "\"", "N", "kg m"])
    lines[k] = ",".join(cells)


def _cut(text, chance):
    return text[:chance.randrange(len(text))]


def _sign(text, chance):
    at = chance.randrange(len(text))
    return text[:at] + chance.choice('"[]{}=,.#\n\\\0\x85é9-e') + text[at + 1:]


OPERATORS = {
    "line lost": _lines(lambda lines, k, chance: lines.pop(k)), "line twice": _lines(lambda lines, k, chance: lines.insert(k, lines[k])),
    "line moved": _lines(lambda lines, k, chance: lines.insert(chance.randrange(len(lines)), lines.pop(k))), "value": _lines(_value), "key": _lines(_key),
    "cell": _lines(_cell), "cut off": _cut, "sign": _sign,
}


def mutated(text, seed):
    """A changed text, and the name of the mistake."""
    chance = random.Random(seed)
    while True:
        name = chance.choice(list(OPERATORS))
        new = OPERATORS[name](text, chance)
        if new != text:
            return new, name
