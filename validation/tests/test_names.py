"""The check of identifiers against the glossary (docs/book/check_names.py) finds what it is for."""

import importlib.util
from pathlib import Path

PATH = Path(__file__).resolve().parents[2] / "docs/book/check_names.py"
spec = importlib.util.spec_from_file_location("check_names", PATH)
names = importlib.util.module_from_spec(spec)
spec.loader.exec_module(names)

GLOSSARY = """
| Term | Meaning | Symbol, unit | Do not use |
|---|---|---|---|
| crack onset strain | Where damage begins. | ε₀, 1 | limit strain |
| force | Action on A. | N | push, shove (in prose) |
| bond | Cohesive contact. | | |
"""


def test_words_of_the_glossary():
    assert names.forbidden(GLOSSARY) == {"limit strain": "crack onset strain", "push": "force"}


def test_words_are_parts_of_identifiers():
    found = [hit[1:] for hit in names.hits(enumerate(["LimitStrain", "old_limit_strain", "LIMIT_STRAIN", "pushed", "push_back", "limits"]), ["limit strain", "push"])]
    assert found == [("LimitStrain", "limit strain"), ("old_limit_strain", "limit strain"), ("LIMIT_STRAIN", "limit strain"), ("push_back", "push")]


def test_comments_and_strings_do_not_count():
    rust = '/* push\n */ // push\nlet a = b"push \\" push"; let b = \'"\'; let c = r#"push " push"#;\nfn f<\'a>(push: &\'a str) {}\n'
    assert [line for line, name in names.identifiers_of_rust(rust) if name == "push"] == [4]
    python = '"""push"""\n# push\nif push:\n    a = "push"\n'
    assert [line for line, name in names.identifiers_of_python(python) if name == "push"] == [3]


def test_a_wrong_identifier_is_told_with_file_and_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(names, "ROOT", tmp_path)
    monkeypatch.setattr(names, "GLOSSARY", tmp_path / "glossary.md")
    monkeypatch.setattr(names, "OTHER_MEANINGS", {"push": "to append"})
    monkeypatch.setattr(names, "AT_BORDERS", {"limit strain": {"host.rs", "table.rs"}})
    monkeypatch.setattr(names, "sources", lambda: [tmp_path / "law.rs", tmp_path / "host.rs", tmp_path / "table.rs"])
    (tmp_path / "glossary.md").write_text(GLOSSARY, encoding="utf-8")
    for name in ("law.rs", "host.rs"):
        (tmp_path / name).write_text("fn law() {\n    let limit_strain = 1;\n}\n", encoding="utf-8")
    (tmp_path / "table.rs").write_text("fn law() {}\n", encoding="utf-8")
    assert names.main() == 1
    told = capsys.readouterr().err.splitlines()
    assert told[0] == 'law.rs:2: `limit_strain`: not "limit strain", but "crack onset strain" (docs/glossary.md)'
    # An excuse for a word that no source uses is of no use, nor is one for a file that does not use it.
    assert len(told) == 3 and '"push"' in told[1] and "table.rs" in told[2]


def test_attributes_of_yade_keep_their_names():
    found = [name for _, name, _ in names.hits(enumerate(["tanFrictionAngle", "friction_angle", "TanFriction"]), ["friction angle", "tan friction"])]
    assert found == ["friction_angle", "TanFriction"]
