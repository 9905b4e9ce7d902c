"""The documentation says what the code does: links, examples and tables are checked against it."""

from __future__ import annotations

import re
import shlex
import textwrap
import tomllib
from functools import cache
from pathlib import Path

import pytest
from kilauea import aovs, arguments, cli, errors, interrupt
from kilauea.checking import criteria

ROOT = Path(__file__).resolve().parents[2]
COMMAND_LINE = "docs/command-line.md"
CHECKING = "docs/checking.md"
PAGES = sorted(
    str(page.relative_to(ROOT))
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md"))
)


@cache
def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def prose(page):
    """The page without code blocks."""
    return re.sub(r"^```.*?^```$", "", text(page), flags=re.MULTILINE | re.DOTALL)


def headings(page):
    """The anchors of a page, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", t.lower()).replace(" ", "-") for t in titles}


def section(page, title):
    """What stands between a heading and the next one of any level."""
    return re.split(rf"^#+ {re.escape(title)}$", prose(page), flags=re.MULTILINE)[1].split("\n#")[0]


def code_spans(markdown):
    return re.findall(r"`([^`]+)`", markdown)


def first_cells(markdown):
    """The first cell of each row of the tables, headers left out."""
    rows = re.findall(r"^\| (.*?) \|", markdown, flags=re.MULTILINE)
    tables = re.findall(r"^\| (.*?) \|.*\n\|-", markdown, flags=re.MULTILINE)
    return [cell for cell in rows if cell not in tables]


def spans_of_first_cells(markdown):
    return [span for cell in first_cells(markdown) for span in code_spans(cell)]


def commands(page):
    blocks = re.findall(r"^```sh\n(.*?)^```$", text(page), flags=re.MULTILINE | re.DOTALL)
    for line in "".join(blocks).splitlines():
        words = shlex.split(line, comments=True)
        while words:
            end = words.index("&&") if "&&" in words else len(words)
            if words[:1] == ["kilauea"]:
                yield words[1:end]
            words = words[end + 1 :]


COMMANDS = [words for page in PAGES for words in commands(page)]


@pytest.mark.parametrize("page", PAGES)
def test_links_resolve(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if link.startswith(("https://", "http://")):
            continue
        name, _, anchor = link.partition("#")
        target = (ROOT / page).parent / name if name else ROOT / page
        assert target.exists(), link
        if anchor:
            assert anchor in headings(str(target.resolve().relative_to(ROOT))), link


def test_every_decision_is_listed():
    pages = {p.name for p in (ROOT / "docs/decisions").glob("[0-9]*.md")}
    assert pages == set(re.findall(r"\((\d+-[\w-]+\.md)\)", text("docs/decisions/README.md")))


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_examples_parse(words, monkeypatch):
    for variable in ("AOV", "OUTPUT", "CAMERA"):
        monkeypatch.delenv(f"KILAUEA_{variable}", raising=False)
    args = cli._parser(words[0]).parse_args(words)
    assert not getattr(args, "ignored_flags", None)
    if words[0] in ("render", "reference"):
        assert args.stage
        assert args.output


def test_examples_are_found():
    assert len([words for words in COMMANDS if words[0] == "render"]) >= 4


def visible_options():
    parser = cli._parser("render").commands["render"]
    return [a for a in parser._actions if a.dest not in ("_ignored", "help") and a.option_strings]


def test_options_are_those_of_the_parser():
    documented = spans_of_first_cells(section(COMMAND_LINE, "Options"))
    assert documented == [flag for action in visible_options() for flag in action.option_strings]


def test_choices_are_those_of_the_parser():
    rows = section(COMMAND_LINE, "Options").splitlines()
    for action in visible_options():
        if action.choices:
            row = next(row for row in rows if f"`{action.option_strings[-1]}`" in row)
            assert code_spans(row.split("|")[2]) == list(action.choices)


def test_options_of_check_are_those_of_the_parser():
    parser = cli._parser("check").commands["check"]
    stage_options = arguments.ArgumentParser()
    arguments.add_stage_options(stage_options)
    shared = {flag for a in stage_options._actions for flag in a.option_strings}
    own = [f for a in parser._actions for f in a.option_strings if f not in shared]
    assert spans_of_first_cells(section(CHECKING, "Options")) == own


def test_thresholds_of_check_are_its_criteria():
    rows = re.findall(
        r"^\| `([\w-]+)` \| ([\d.%]+) \|", section(CHECKING, "Thresholds"), re.MULTILINE
    )
    assert tuple(name for name, _ in rows) == criteria.NAMES
    read = criteria.parse_criteria([f"{name}={value}" for name, value in rows])
    assert read == criteria.Criteria()


def test_findings_of_check_are_listed():
    source = text("usd_bridge/python/kilauea/checking/judge.py")
    written = list(dict.fromkeys(re.findall(r'Finding\(\s*"(\w+)"', source)))
    assert spans_of_first_cells(section(CHECKING, "What is judged")) == written


def test_ignored_flags_are_those_of_the_parser():
    flags, silent = arguments._IGNORED_FLAGS, arguments._SILENTLY_IGNORED
    ignored = section(COMMAND_LINE, "Ignored flags")
    introduction, listed = ignored.split(":\n", 1)
    assert set(code_spans(introduction)) == silent
    assert code_spans(listed) == list(flags)


def test_environment_variables_exist():
    known = {f"KILAUEA_{a.dest.upper()}" for a in visible_options()}
    sources = "".join(p.read_text() for p in (ROOT / "usd_bridge/python").rglob("*.py"))
    for name in re.findall(r"KILAUEA_[A-Z_]+", section(COMMAND_LINE, "Environment")):
        assert name in known or f'"{name}"' in sources, name


def test_exit_codes():
    documented = {int(c) for c in first_cells(section(COMMAND_LINE, "Exit codes"))}
    classes = [c for c in vars(errors).values() if isinstance(c, type)]
    assert documented == {0, interrupt.EXIT_CODE, *(c.exit_code for c in classes)}


def aov_rows():
    """Name, channels, rule and description of each layer, from the engine's table."""
    table = text("crates/kilauea-film/src/aov.rs").split("TABLE: [AovRow")[1].split("impl Aov")[0]
    for row in re.findall(r"AovRow \{(.*?)\n    \},", table, flags=re.DOTALL):
        channels = re.search(r"channels: &\[(.*?)\]", row, flags=re.DOTALL)[1]
        doc = re.search(r'doc: "((?:[^"\\]|\\.)*)"', row, flags=re.DOTALL)[1]
        yield (
            re.search(r'name: "([^"]+)"', row)[1],
            re.findall(r'"([^"]+)"', channels),
            re.search(r"rule: Rule::(\w+)", row)[1].lower(),
            re.sub(r"\\\n\s*", "", doc),
        )


def test_layers_are_those_of_the_film():
    rows = [row.strip("| ").split(" | ") for row in section(COMMAND_LINE, "Layers").splitlines()]
    documented = [
        (code_spans(r[0])[0], code_spans(r[1]), r[2], r[3]) for r in rows if r[0][:1] == "`"
    ]
    assert documented == list(aov_rows())
    assert [row[0] for row in documented] == aovs.known()


def struct_fields(source, name):
    body = re.search(rf"pub struct {name} \{{(.*?)^\}}", source, flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"pub (\w+): ([\w<>& ']+),", body[1])


def test_statistics_are_those_of_the_engine():
    source = text("crates/kilauea-render/src/stats.rs")
    written = set()
    for field, kind in struct_fields(source, "RenderStats"):
        if f"pub struct {kind} " in source:
            written |= {f"{field}.{inner}" for inner, _ in struct_fields(source, kind)}
        else:
            written.add(field)
    cluster = text("crates/kilauea-cluster/src/stats.rs")
    written |= {"workers"} | {
        f"network.{name}" for name, _ in struct_fields(cluster, "NetworkStats")
    }
    (workers,) = re.findall(r"^\| `workers` \|(.*)$", text(COMMAND_LINE), flags=re.MULTILINE)
    for name, _ in struct_fields(cluster, "WorkerStats"):
        assert f"`{name}`" in workers
    # The bridge adds these.
    completed = text("usd_bridge/python/kilauea/render.py").split("def _complete")[1]
    written |= set(re.findall(r'stats\["(\w+)"\] =', completed))
    written |= {f"times.{name}" for name in re.findall(r'times\["(\w+)"\] =', completed)}
    documented = spans_of_first_cells(section(COMMAND_LINE, "Statistics"))
    assert sorted(documented) == sorted(written)


def test_header_texts_are_those_of_the_bridge():
    written = set(re.findall(r'"(kilauea/\w+)"', text("usd_bridge/src/job.rs")))
    spans = spans_of_first_cells(section(COMMAND_LINE, "Image headers"))
    assert {span for span in spans if span.startswith("kilauea/")} == written


def test_tile_header_is_that_of_the_engine():
    def fields(table):
        return re.findall(r"^\| (\d+) \| ([^|]+) \|", table, flags=re.MULTILINE)

    source = text("crates/kilauea-texture/src/lib.rs").replace("//! ", "")
    assert fields(section("docs/file-formats.md", "Tile files")) == fields(source) != []


def test_the_example_shader_is_the_one_that_is_tested():
    page = text("docs/writing-shaders.md")
    example = text("shaders/tests/writing_shaders/checker.rs")
    assert f"```rust\n{example}```\n" in page
    shade = text("shaders/tests/writing_shaders/tinted_bounce.rs").split("\n\n")[-1]
    method = textwrap.dedent(shade.removesuffix("}\n"))
    assert f"```rust\n{method}```\n" in page
    shader_list = re.search(r"list::shaders! \{[^}]*\}", text("shaders/src/lib.rs"))[0]
    assert shader_list in page


def test_what_a_shader_implements():
    trait = text("crates/kilauea-shading/src/shader.rs").split("pub trait SurfaceShader")[1]
    methods = re.findall(
        r"^    (?:async fn|fn|const) (\w+)", trait.split("\n}\n")[0], flags=re.MULTILINE
    )
    documented = section("docs/writing-shaders.md", "What a shader implements")
    assert spans_of_first_cells(documented) == methods


def test_crates_use_what_the_architecture_says():
    page = text("docs/architecture.md")
    documented = dict(re.findall(r"^\*\*`([\w/-]+)`\*\* \(([^)]*)\)\.", page, flags=re.MULTILINE))
    manifests = [*(ROOT / "crates").glob("*/Cargo.toml"), ROOT / "shaders/Cargo.toml"]
    used = {}
    for manifest in (*manifests, ROOT / "usd_bridge/Cargo.toml"):
        folder = (
            manifest.parent.relative_to(ROOT).as_posix().replace("usd_bridge", "usd_bridge/src")
        )
        dependencies = tomllib.loads(manifest.read_text())["dependencies"]
        ours = {d for d in dependencies if d.startswith("kilauea-") or d == "shaders"}
        used[folder] = {d.removeprefix("kilauea-") for d in ours} or {"none"}
    assert {crate: set(names.split(", ")) for crate, names in documented.items()} == used


def test_usd_is_imported_in_one_place():
    python = ROOT / "usd_bridge/python/kilauea"
    pattern = re.compile(r"^\s*(from|import) pxr\b", flags=re.MULTILINE)
    users = {
        p.relative_to(python).parts[0]
        for p in python.rglob("*.py")
        if pattern.search(p.read_text())
    }
    assert users == {"usd"}


def test_names_of_code_exist():
    """Tests and fields that a page names are somewhere in the sources."""
    folders = ("crates", "shaders", "tests", "usd_bridge/src", "usd_bridge/python", "pipeline")
    files = [p for f in folders for s in ("*.rs", "*.py") for p in (ROOT / f).rglob(s)]
    files += [p for p in (ROOT / "usd_bridge/tests").glob("*.py") if p != Path(__file__)]
    files += (ROOT / "usd_bridge/ray_tests").glob("*.py")
    files += [ROOT / "Cargo.toml"]
    known = set(re.findall(r"\w+", " ".join(p.read_text(encoding="utf-8") for p in files)))
    for page in PAGES:
        spans = code_spans(prose(page))
        names = [s for s in spans if re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+){2,}", s)]
        assert [name for name in names if name not in known] == [], page


def test_pictures_are_small_and_explained():
    explained = spans_of_first_cells(text("docs/images/README.md"))
    pictures = {p.name: p.stat().st_size for p in (ROOT / "docs/images").iterdir()}
    assert set(pictures) == {*explained, "README.md"}
    assert max(pictures.values()) < 600_000


def test_faults_are_made_by_the_tests_that_are_named():
    rows = re.findall(r"^\| [^|]+ \| [^|]+ \| (.+) \|$", text("docs/faults.md"), flags=re.MULTILINE)
    named = {name for cell in rows for name in code_spans(cell)}
    assert len(named) > 30
    folders = ("crates/kilauea-cluster/src", "crates/kilauea-cluster/tests", "usd_bridge/tests")
    files = [
        file for folder in (*folders, "usd_bridge/ray_tests") for file in sources(ROOT / folder)
    ]
    defined = {
        name for file in files for name in re.findall(r"(?:fn|def) (\w+)\(", file.read_text())
    }
    assert named <= defined


def sources(folder):
    return [file for suffix in ("rs", "py") for file in folder.rglob(f"*.{suffix}")]
