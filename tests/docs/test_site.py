"""The site's pages are staged from the checkout: what they link exists, and what was built fetches nothing."""

import re
from importlib.util import find_spec

import numpy as np
import pytest

from docs.site import api, check, code, evidence, gallery, layout, planted, stage, symptoms, words
from figures.report.glossary import PAPERS
from restir_ref import Live, Pixels, initial
from restir_ref.oracle.zoo import BUGS, INEFFICIENT
from restir_ref.oracle.zoo.page import NOT_IN_THE_ZOO
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.cached import CACHE_BUGS
from restir_ref.transport.proofs.zoo.gradients import GRADIENT_BUGS
from tests.checkout import ROOT, plant

BUILT = ROOT / "out-docs" / "html"
needs_sphinx = pytest.mark.skipif(
    not (find_spec("sphinx") and find_spec("furo") and find_spec("myst_parser") and find_spec("latex2mathml")),
    reason="no Sphinx here: make docs installs it",
)
needs_site = pytest.mark.skipif(not (BUILT / "searchindex.js").exists(), reason="no site here: make docs")


@pytest.fixture(scope="module")
def staged() -> dict[str, str]:
    return dict(stage.pages())


# ---------------------------------------------------------------- what is staged


def test_every_page_of_documentation_every_module_every_figure_and_every_paper_has_a_page(staged) -> None:
    files = {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert files <= layout.pages().keys()
    wanted = {f"{place}.md" for place in layout.pages().values()}
    wanted |= {f"api/{name}.rst" for name in layout.modules()}
    wanted |= {f"figures/{id_}.rst" for id_ in gallery.entries()}
    wanted |= {f"claims/{id_.partition('-')[0]}.rst" for id_ in gallery.claims()}
    assert wanted <= staged.keys()


def test_every_page_stands_in_a_list_of_pages_or_in_an_index_of_its_own(staged) -> None:
    listed = set(re.findall(r"^[\w/-]+$", staged["index.md"], re.MULTILINE))
    alone = {name for name, text in staged.items() if text.startswith(":orphan:")}
    assert {name.rpartition(".")[0] for name in staged.keys() - alone} - {"index"} == listed


def test_every_row_of_the_readme_leads_to_functions_or_to_pages() -> None:
    assert len(api.rows()) > 30
    for row in api.rows():
        named = {each.name for each in api.shown_by(row)}
        assert named <= api.public()
        assert named or all(layout.place(path) for path in row.where), row.what


def test_a_row_leads_to_the_function_that_says_its_equation() -> None:
    (row,) = [row for row in api.rows() if row.what.startswith("MIS weights")]
    assert {"restir_ref.mis.talbot", "restir_ref.mis.pairwise"} <= {each.name for each in api.shown_by(row)}


def test_every_claim_and_every_figure_of_the_ledger_is_told(staged) -> None:
    for id_, row in gallery.claims().items():
        text = staged[f"claims/{row.paper}.rst"]
        assert f'<span id="{id_}">' in text
    for id_, run in gallery.runs().items():
        for each in run.checks:
            assert each["verdict"] in staged[f"figures/{id_}.rst"]


def test_a_test_that_shows_several_parts_of_a_claim_is_listed_once_with_all_of_them() -> None:
    listed = [line for line in gallery.tests("DDGIR-E06", "claims/DDGIR.html") if "albedo" in line]
    assert len(listed) == 1
    assert listed[0].endswith(" (every lobe, by quadrature; flatland2d, tracer3d)")


def test_a_figure_without_a_picture_says_what_to_run(monkeypatch) -> None:
    monkeypatch.setattr(gallery, "picture", lambda id_: None)
    page = "\n".join(gallery.page(gallery.entries()["GRIS-F07"]))
    assert "make figures ARGS=GRIS-F07" in page
    assert "GRIS-E37" in page


def test_every_erratum_names_what_shows_it(staged) -> None:
    told = [part for part in re.split(r"^### ", staged["errata.md"], flags=re.MULTILINE)[1:] if "*Printed*" in part]
    assert len(told) >= 18
    for part in told:
        assert re.search(r'<a href="(code/tests|claims)/', part), part.partition("\n")[0]


def test_every_paper_has_its_errata(staged) -> None:
    assert set(re.findall("^## (.+)$", staged["errata.md"], re.MULTILINE)) == set(PAPERS) - {"COM"}


# ---------------------------------------------------------------- words


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("see `restir_ref/mis.py`", '<a href="../api/restir_ref.mis.html"><code>restir_ref/mis.py</code></a>'),
        ("[GRIS Eq. 36]", '<a href="../references.html#ref-gris">[GRIS Eq. 36]</a>'),
        ("[Chao 1982]", '<a href="../references.html#ref-chao-1982">[Chao 1982]</a>'),
        ("[notation](notation.md#paths)", "[notation](../notation.md#paths)"),
        ("[this](../LICENSE)", '<a href="../code/LICENSE.html">this</a>'),
        ("`GRIS-E37`", '<a href="../claims/GRIS.html#GRIS-E37"><code>GRIS-E37</code></a>'),
        ("$`x^2`$", "$x^2$"),
        ("`x_i` and [a, b]", "`x_i` and [a, b]"),
        ("[DOI](https://doi.org/1)", "[DOI](https://doi.org/1)"),
        ("```python\n`restir_ref/mis.py`\n```", "```python\n`restir_ref/mis.py`\n```"),
    ],
)
def test_markdown_links_what_it_names(text, wanted) -> None:
    assert words.markdown(text, "docs/page.md", "deep/page.html").removeprefix("see ") == wanted


@pytest.mark.parametrize("text", ["[gone](gone.md)", "`tests/core/test_mis.py::test_that_is_gone`"])
def test_a_link_to_what_is_not_there_is_an_error(text) -> None:
    with pytest.raises(ValueError, match="mend"):
        words.markdown(text, "docs/page.md", "page.html")


def test_formulas_of_docstrings_mean_themselves() -> None:
    said = "m_i = c_i |x| * p_hat_`x`\n\n    a * b\n\n- one\n- two\n  and more\n\n>>> 1 + 1\n2"
    lines = words.rst(said, "api/x.html", lambda code: "")
    assert lines[0] == "m\\_i = c\\_i \\|x\\| \\* p\\_hat\\_\\ ``x``\\ "
    assert lines[2:5] == ["::", "", "       a * b"]
    assert lines[6:8] == ["- one", "- two and more"]
    assert lines[9:11] == [">>> 1 + 1", "2"]


def test_names_in_docstrings_lead_to_what_they_mean() -> None:
    resolve = api.resolver("restir_ref.restir")
    assert resolve("select") == "restir_ref.resampling.select"
    assert resolve("spatial") == "restir_ref.restir.spatial"
    assert resolve("WEIGHTS") == resolve("len") == resolve("no such name") == ""
    assert api.resolver("restir_ref")("oracle") == "restir_ref.oracle"


# ---------------------------------------------------------------- evidence


def test_the_evidence_has_its_summary_on_top_and_every_row_below() -> None:
    page = evidence.page()
    assert page.index("| job |") < page.index("<details>")
    assert page.count("<details>") == page.count("\n## ") - 1 == len(evidence.jobs())
    rows = sum(len(job["rows"]) for job in evidence.jobs().values())
    assert f"| {rows} |" in page


def test_the_worst_z_is_of_rows_that_ask_for_a_small_one() -> None:
    rows = [
        {"limit": "|z| <= 4, SE <= 0.5%", "value": 0.01, "error": 0.005},
        {"limit": "|z| <= 4, SE <= 0.5%", "value": -0.03, "error": 0.01},
        {"limit": "control: |bias| > 1%, |z| >= 8", "value": 9.0, "error": 0.1},
        {"limit": "< 0.1%", "value": 5.0, "error": None},
    ]
    assert evidence.worst_z(rows) == pytest.approx(3)
    assert evidence.worst_error(rows) == 0.01
    assert evidence.worst_z(rows[2:]) == evidence.worst_error(rows[2:]) == 0


# ---------------------------------------------------------------- symptoms

MISTAKES = (*NOT_IN_THE_ZOO, *BUGS, *INEFFICIENT, *TRANSPORT_BUGS, *CACHE_BUGS, *GRADIENT_BUGS)


def test_every_mistake_of_the_zoo_has_a_small_picture_on_the_page_of_symptoms() -> None:
    page, folder = symptoms.page(), ROOT / "docs" / "symptoms"
    wanted = {symptoms.slug(name): symptoms.file(name) for name in MISTAKES}
    assert len(wanted) == len(MISTAKES)
    assert {file.stem for file in folder.iterdir()} == wanted.keys()
    for name, file in wanted.items():
        assert (folder / f"{name}.png").stat().st_size < 60_000
        assert page.count(f"]({file})") == 1, name


def test_what_is_not_in_the_zoo_is_planted_too() -> None:
    assert tuple(planted.OTHERS) == NOT_IN_THE_ZOO


def few(monkeypatch) -> None:
    for name, value in {"SIDE": 12, "REPLICAS": 4, "BATCHES": 1}.items():
        monkeypatch.setattr(planted, name, value)


def test_a_mistake_planted_in_flatland_is_the_zoo_s_own(monkeypatch) -> None:
    """Dividing by M once more halves every pixel."""
    few(monkeypatch)
    right, wrong = planted.both(BUGS["divided by M twice"])
    assert right.sum() > 0
    assert wrong == pytest.approx(right / 2)


def test_a_mistake_in_a_shift_is_planted_above_the_shift_of_paths(monkeypatch) -> None:
    few(monkeypatch)
    wrong = planted.film().made_of(BUGS["Jacobian left out"].wrong.here).now
    here, near = Pixels(wrong, np.arange(144)), Pixels(wrong, np.roll(np.arange(144), 1))
    X = initial(near, Live(np.random.default_rng(1)))
    J = wrong.of.shift(X.x, near.index, Pixels(wrong.of, here.index)).J
    assert set(wrong.shift(X.x, near.index, here).J) == {0.0, 1.0}
    assert len(set(J)) > 2


def test_a_difference_is_shown_where_it_is_more_than_noise() -> None:
    """Three standard errors of a normal variable: by chance in one place of 370; neighbours are not independent."""
    noise = np.random.default_rng(1).normal(size=(200, 40, 40))
    assert (planted.significant(noise) != 0).mean() < 0.02
    there = planted.significant(noise + np.repeat([0.0, 1.0], 20))
    assert (there[:, :18] != 0).mean() < 0.02
    assert (abs(there[:, 22:] - 1) < 0.2).all()


def test_the_room_whose_box_moves_is_the_same_room_where_it_stands() -> None:
    now, before = planted.room().scene.corners, planted.standing(planted.STEP).corners
    assert (planted.standing(0).corners == now).all()
    assert (before != now).any(axis=(0, 1)).sum() == 4


def test_a_mistake_that_is_made_of_cells_has_the_exact_picture_of_its_scene(monkeypatch) -> None:
    few(monkeypatch)
    assert planted.picture_of("two-to-one shift")[1] == "exact"
    assert planted.picture_of("1/M over unequal supports")[1] == "planted"


# ---------------------------------------------------------------- what is checked of a site

FETCHES = {
    "a script": '<script src="https://example.org/x.js"></script>',
    "a style": '<link rel="stylesheet" href="//example.org/x.css">',
    "a picture": '<img src="http://example.org/x.png">',
    "a set of pictures": '<img srcset="https://example.org/x.png 2x">',
    "a font": "<style>@font-face { src: url('https://example.org/x.woff') }</style>",
    "an import": "<script>import('https://example.org/x.js')</script>",
}


@pytest.mark.parametrize("text", FETCHES.values(), ids=FETCHES)
def test_what_is_fetched_from_others_is_noticed(tmp_path, text) -> None:
    assert len(check.requests(plant(tmp_path, "page.html", text))) == 1


def test_styles_and_scripts_that_fetch_are_noticed(tmp_path) -> None:
    plant(tmp_path, "x.css", "@import 'https://example.org/x.css';")
    assert len(check.requests(plant(tmp_path, "x.js", 'fetch("https://example.org/")'))) == 2


def test_links_for_people_and_files_of_the_site_are_no_requests(tmp_path) -> None:
    text = '<a href="https://doi.org/10.1145/1">doi</a><img src="x.png"><script src="x.js"></script>'
    assert check.requests(plant(tmp_path, "page.html", text)) == []


def test_a_function_of_the_very_name_is_found_first_then_names_and_words(tmp_path) -> None:
    objects = '{"a": [[1, 0, 1, "", "like_pairs"]], "b": [[0, 0, 1, "", "pairs"]]}'
    text = f'Search.setIndex({{"docnames": ["b", "a", "c"], "terms": {{"pair": [0, 2]}}, "objects": {objects}}})'
    plant(tmp_path, "searchindex.js", text)
    assert check.searched(tmp_path, "pairs") == ["b", "a", "c"]


@pytest.mark.parametrize("url", ["gone.html", "page.html#gone", "#gone", "x.png", "../page.html"])
def test_a_link_into_nowhere_is_noticed(tmp_path, url) -> None:
    plant(tmp_path, "site/page.html", f'<p id="here"><a href="{url}">x</a><a href="#here">y</a>')
    assert check.broken(tmp_path / "site") == [f"page.html -> {url}"]


# ---------------------------------------------------------------- built


@needs_sphinx
def test_a_page_is_laid_out_without_a_warning_and_found_by_the_search(tmp_path) -> None:
    """A part of the site: the module of MIS weights, and pages of formulas."""
    from docs.site.__main__ import laid_out  # noqa: PLC0415

    pages = dict(api.pages())
    apart = "[GRIS Eq. 36] $`\\frac{1}{M}`$\n\n```math\nx^2 \\tag{GRIS 2}\n```\n"
    index = "# A part\n\n" + words.markdown(apart, "docs/x.md", "index.html") + "\n```{toctree}\nreferences\n```\n"
    plant(tmp_path, "source/api/index.rst", ":orphan:\n\nAll\n===\n")
    plant(tmp_path, "source/api/restir_ref.mis.rst", pages["api/restir_ref.mis.rst"])
    plant(tmp_path, "source/references.md", stage.page("docs/references.md", "references"))
    plant(tmp_path, "source/index.md", index)
    assert laid_out(tmp_path) == 0
    assert check.searched(tmp_path / "html", "pairwise")[0] == "api/restir_ref.mis"
    page = check.site(tmp_path / "html")["api/restir_ref.mis.html"]
    assert {"restir_ref.mis.talbot", "restir_ref.mis.Weights.proxy"} <= page.anchors
    assert check.requests(tmp_path / "html") == []
    assert "<math" in (tmp_path / "html" / "index.html").read_text(encoding="utf-8")
    plant(tmp_path, "source/index.md", index + "[gone](gone.md)\n")
    assert laid_out(tmp_path) != 0


@needs_site
def test_no_page_of_the_site_fetches_anything_and_every_link_leads_somewhere() -> None:
    assert check.requests(BUILT) == check.broken(BUILT) == []


@needs_site
def test_a_search_for_pairwise_finds_the_module_of_weights_first() -> None:
    assert check.searched(BUILT, "pairwise")[0] == "api/restir_ref.mis"


@needs_site
def test_every_row_of_the_readme_links_a_rendered_function_or_page() -> None:
    links = set(check.site(BUILT)["equations.html"].links)
    for row in api.rows():
        named = [f"{layout.module_place(api.owner(each.name))}#{each.name}" for each in api.shown_by(row)]
        assert links & {*named, *(layout.place(path) for path in row.where)}, row.what


def test_a_file_of_code_is_shown_whole() -> None:
    shown = code.shown("restir_ref/mis.py")
    assert shown.count('id="L-') == len((ROOT / "restir_ref" / "mis.py").read_text(encoding="utf-8").splitlines())
