"""Report page: loads nothing, states every number with its unit, and shows every failure."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.contact.hertz import line_gap, line_pressure
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import catalogue, quantity
from asperity.coupling import contact_vibration
from asperity.ehl import (
    ContactError,
    ContactSolution,
    ContactState,
    Convergence,
    Iteration,
    SolveStatus,
    Uncertainty,
    hertz_zone,
)
from asperity.ehl.outcome import Figures, GridError
from asperity.report import base, surface_map, write_report
from asperity.report.run import contact, friction_maps, page, vibration
from asperity.report.run import several_runs as against_roughness
from asperity.report.style import CONTACT_COLOUR, svg
from asperity.results import Run, total_error
from asperity.surface import (
    MeasuredSurface,
    Surface,
    SurfaceDescription,
    flat_surface,
    surface_parameters,
)

CASE = """
[contact]
geometry = "line"
radius = "5.4 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "1.91 m/s"
slip = 0.2
[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3
hardness = "2 GPa"
[lubricant]
viscosity = { law = "barus", eta0 = "0.096 Pa s", alpha = "18.2 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.88 g/cm^3" }
rheology = { law = "newtonian" }
[surface]
kind = "gaussian"
sq = "1.25 um"
correlation_length = "40 um"
seed = 7
[grid]
cells = [32, 24]
x = [-4.5, 1.9]
y = [-1.6, 1.6]
[vibration]
mass = "0.1 kg"
damping_ratio = 0.02
duration = "1 s"
"""
HISTORY = tuple(
    Iteration(
        (n, n * 3 // 4),
        k,
        10.0 ** (-k / 2 - 1),
        10.0 ** (-k - 1),
        10.0 ** (-k / 3 - 1) if k else np.inf,
    )
    for n in (16, 32)
    for k in range(7)
)


def solution_like(case, surface=None, status=SolveStatus.CONVERGED):
    """Fields a solver could return: Hertz pressure, with contact on the highest roughness."""
    surface = surface or case.surface()
    x = surface.grid.x[:, None]
    half_width, p_max = case.conditions.hertz.half_widths[0], case.conditions.hertz.p_max
    gap = line_gap(x, half_width, case.conditions.radius_along_rolling) + 0.7e-6 - surface.heights
    in_contact = (gap <= 5e-9) & (np.abs(x) < 2.0 * half_width)
    pressure = (
        line_pressure(x, half_width, p_max) * np.ones(surface.grid.cells) + 0.4e9 * in_contact
    )
    return ContactSolution(
        conditions=case.conditions,
        lubricant=case.lubricant,
        surface=surface,
        options=case.options,
        pressure=pressure,
        gap=np.maximum(gap, 5e-9),
        in_contact=in_contact,
        rigid_approach=0.0,
        convergence=Convergence(status, HISTORY, 1e-4, 1.234),
    )


def run_like(text=CASE, *, status=SolveStatus.CONVERGED, surface=None, notes=(), **numbers):
    case = load_case(text, stored=surface)
    state = ContactState(
        **{
            "car": 0.3712,
            "car_domain": 0.6034,
            "clr": 0.5423,
            "sq": 1.25e-6,
            "h_min": 4.9e-9,
            "h_central": 0.512e-6,
            "capped_oil_load_ratio": 0.0321,
            "h_mean": 0.634e-6,
            "lambda_ratio": 0.584,
            "p_max": 1.987e9,
            "reynolds_residual": 3.1e-6,
            "load_error": 2.3e-7,
            "mass_flux_imbalance": 0.694,
            **numbers,
        }
    )
    vibration = (
        None
        if case.vibration is None
        else contact_vibration(state, case.conditions, case.vibration)
    )
    solution = solution_like(case, case.stored, status)
    return with_uncertainty(
        Run(case=case, solution=solution, state=state, vibration=vibration, notes=notes)
    )


def with_uncertainty(run, half=None, others=()):
    """The run with an interval of its load share and numbers of further surfaces."""
    sides = None if half is None else (half, half)
    contact_error = ContactError(
        clr=Uncertainty(value=run.state.clr, iteration=sides, grid=sides, range=(0.0, 1.0))
    )
    state = replace(run.state, error=contact_error)
    rows = (run.summary_row, *others)
    error = total_error(state, rows, run.case.conditions, run.case.vibration, run.vibration)
    return replace(run, state=replace(state, error=error), others=tuple(others))


class Page(HTMLParser):
    """Parsed page: tags with attributes, and table rows as text cells."""

    def __init__(self, html):
        super().__init__()
        self.html = html
        self.tags = []
        self.rows = []
        self.text = ""
        self.in_cell = False
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self.in_cell = True

    def handle_endtag(self, tag):
        self.in_cell = self.in_cell and tag not in ("td", "th")

    def handle_data(self, data):
        self.text += data
        if self.in_cell:
            self.rows[-1][-1] += data

    def images(self):
        return [attributes for tag, attributes in self.tags if tag == "img"]


def texts_of(figure):
    """The texts of a figure in place of its encoding, which takes most of a page's time.

    Without the numbers at ticks, which would be created only for this.
    """
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    texts = [*figure.texts, *(text for legend in legends if legend for text in legend.get_texts())]
    for axes in figure.axes:
        texts += axes.texts
    labels = [text.get_text() for text in texts]
    for axes in figure.axes:
        labels += [axes.get_title(), axes.get_title("left"), axes.get_xlabel(), axes.get_ylabel()]
    return f"<svg>{labels}</svg>"


@pytest.fixture
def without_image_files(monkeypatch):
    """Draw figures without encoding them; for tests of text."""
    monkeypatch.setattr(base, "svg", texts_of)


@pytest.fixture(scope="module")
def single():
    return Page(page.render_page([run_like(notes=("filled 0.2 % missing cells",))]))


@pytest.fixture(scope="module")
def several():
    """Three runs on one page. Of figures with the same axes only the first is encoded."""
    encoded = set()

    def first_encoded(figure):
        axes = tuple((axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes)
        kind = (axes, tuple(figure.get_size_inches()))
        if kind in encoded:
            return texts_of(figure)
        encoded.add(kind)
        return svg(figure)

    runs = [
        run_like(sq=0.5e-6, car=0.05, clr=0.11),
        run_like(status=SolveStatus.STALLED),
        run_like(
            CASE.replace("500 N", "400 N"), sq=3e-6, car=0.6, clr=0.92, mass_flux_imbalance=0.2
        ),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(base, "svg", first_encoded)
        return Page(page.render_page(runs))


@pytest.mark.parametrize("fixture", ["single", "several"])
def test_page_loads_nothing(fixture, request):
    parsed = request.getfixturevalue(fixture)
    assert not {tag for tag, _ in parsed.tags} & {
        "script",
        "iframe",
        "object",
        "embed",
        "video",
        "audio",
    }
    for tag, attributes in parsed.tags:
        for name in ("src", "href", "srcset", "data", "poster", "action"):
            target = attributes.get(name, "data:")
            linked = tag == "a" and target.startswith(
                ("#", "https://doi.org/")
            )  # a link alone loads nothing
            assert linked or target.startswith("data:"), (tag, name, target[:80])
    assert "url(" not in re.sub(r'src="data:[^"]*"', "", parsed.html)
    assert "@import" not in parsed.html
    for image in parsed.images():
        drawing = unquote(image["src"])
        for target in re.findall(r'href="([^"]*)"', drawing) + re.findall(
            r"url\(([^)]*)\)", drawing
        ):
            assert target.startswith(("#", "data:image/png;base64,")), target[:80]


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("Asperity load share", "54.2 (± not determined)", "%"),
        ("Contact area ratio", "37.1", "%"),
        ("Domain contact area ratio", "60.3", "%"),
        ("Composite roughness", "1.25", "µm"),
        ("Minimum film thickness", "0.005 (± not determined)", "µm"),
        ("Central film thickness", "0.512 (± not determined)", "µm"),
        ("Mean film thickness", "0.634", "µm"),
        ("Lambda ratio", "0.58", ""),
        ("Maximum pressure", "1.987", "GPa"),
        ("Reynolds residual", "3.1×10⁻⁶", ""),
        ("Load error", "2.3×10⁻⁷", ""),
        ("Oil mass imbalance", "69.4", "%"),
        ("Newton iterations", "12", ""),
        ("Solution time", "1.23", "s"),
        ("Converged", "yes", ""),
    ],
)
def test_every_number_is_shown_with_its_unit(single, name, value, unit):
    (row,) = [row for row in single.rows if row[0].startswith(name)]
    assert row[1:] == [value, unit]


@pytest.mark.usefixtures("without_image_files")
def test_a_new_quantity_of_a_shown_group_appears_in_the_table(monkeypatch):
    extra = replace(quantity("clr"), key="made_up", symbol="", name="made-up share", deviation="")
    extended = {**catalogue(), "made_up": extra}
    monkeypatch.setattr("asperity.core.quantities.catalogue", lambda: extended)
    (row,) = [
        row
        for row in Page(page.render_page([run_like()])).rows
        if row[0].startswith("Made-up share")
    ]
    assert row[1:] == ["54.2", "%"]


@pytest.mark.usefixtures("without_image_files")
def test_a_resonance_has_more_than_its_records_fit_deviation(single):
    """The fit gives some hertz, while the error of the load share contributes a hundred."""
    resonance = run_like().vibration.resonance
    (row,) = [row for row in single.rows if row[0].startswith("Contact resonance frequency")]
    value, _, uncertainty = row[1].partition(" ")
    assert float(value) == pytest.approx(resonance.crf_hz, abs=0.06)
    assert uncertainty == "(± not determined)"
    parsed = Page(page.render_page([with_uncertainty(run_like(), 0.02)]))
    (row,) = [row for row in parsed.rows if row[0].startswith("Contact resonance frequency")]
    low, high = (float(end) for end in re.search(r"\((\d+) to (\d+)\)", row[1]).groups())
    assert high - low > 10.0 * resonance.crf_std
    assert row[2] == "Hz"
    (row,) = [row for row in single.rows if row[0].startswith("Contact resonance amplitude")]
    assert row[2] == "(m/s²)²/Hz"
    assert "±" in row[1]


def test_conditions_are_those_of_the_paper(single):
    rows = dict(row for row in single.rows if len(row) == 2)
    assert rows["Load"] == "500 N (50 N/mm)"
    assert (
        rows["Hertz (smooth, dry)"] == "half-width a = 55.93 µm, maximum pressure 0.5691 GPa"
    )  # physics of the paper
    assert rows["Reduced modulus"] == "E* = 109.89 GPa (E′ = 2 E* = 219.78 GPa)"
    assert rows["Viscosity law"] == "barus, η₀ = 0.096 Pa s, α = 18.2 1/GPa"
    assert rows["Roughness"].endswith(
        "kind gaussian, sq 1.25 um, correlation length 40 um and 40 um, seed 7"
    )
    assert rows["Domain"] == "x from −4.50 a to 1.90 a, y from −1.60 a to 1.60 a, repeating in y"


def test_runs_are_labelled_by_their_differences_only(several):
    rows = several.html.split('<tr class="varies">')[1:]
    names = [re.search(r"<th[^>]*>([^<]*)<", row)[1] for row in rows]
    fits = [
        "Fitted central film thickness, Moes",
        "Fitted minimum film thickness, Dowson (1968)",
        "Fitted minimum film thickness, Blok (1952)",
    ]
    given = [
        "Load",
        "Hertz (smooth, dry)",
        "Regime",
        "Dimensionless numbers",
        "Inlet shear heating",
    ]  # at 400 N the bodies count as rigid
    assert sorted(names) == sorted([*given, *fits, "Grid"])  # the grid is given in half-widths
    assert next(row for row in several.rows if row[0] == "Load")[1:] == ["500 N (50 N/mm)"] * 2 + [
        "400 N (40 N/mm)"
    ]
    assert next(row for row in several.rows if row[0] == "Rheology")[1:] == ["newtonian"]


def test_an_unconverged_run_is_prominent(several):
    assert "NOT CONVERGED" in several.html
    assert "stalled after 12 steps" in several.html.lower()
    header = next(row for row in several.rows if row[0] == "Quantity")
    assert ["not converged" in cell for cell in header[1:4]] == [False, True, False]
    assert next(row for row in several.rows if row[0].startswith("Converged"))[1:4] == [
        "yes",
        "NO",
        "yes",
    ]
    assert any("NOT CONVERGED" in unquote(image["src"]) for image in several.images())
    verdicts = [
        a["class"] for tag, a in several.tags if tag == "section" and "verdict" in a["class"]
    ]
    assert verdicts == ["verdict", "verdict unfinished", "verdict"]


def test_a_converged_run_shows_no_warning(single):
    assert "not converged" not in single.text.lower()


def test_names_between_backticks_are_code_and_the_rest_is_escaped():
    written = base.html_sentence("give `rate_hz`, not <b> or `<i>`")
    assert written == "give <code>rate_hz</code>, not &lt;b&gt; or <code>&lt;i&gt;</code>"


@pytest.mark.usefixtures("without_image_files")
def test_external_text_is_escaped():
    hostile = CASE.replace(
        'kind = "gaussian"\nsq = "1.25 um"\ncorrelation_length = "40 um"\nseed = 7', ""
    )
    hostile = hostile.replace("[surface]", '[surface]\nfile = "<script>alert(1)</script>.opd"')
    surface = load_case(CASE).surface()
    parsed = Page(
        page.render_page(
            [run_like(hostile, surface=surface, notes=("<img src=x>",))], title="<b>&</b>"
        )
    )
    assert not [tag for tag, _ in parsed.tags if tag in ("script", "b")]
    assert all(image["src"].startswith("data:") for image in parsed.images())
    assert "<script>alert(1)</script>.opd" in parsed.text
    assert "<img src=x>" in parsed.text
    assert "<b>&</b>" in parsed.text


def test_several_runs_are_drawn_against_roughness(single, several):
    def has_figure(shown, title):
        return sum(title in unquote(image["src"]) for image in shown.images())

    for title in ("Asperity load and area share", ">Contact resonance frequency<"):
        assert has_figure(single, title) == 0
        assert has_figure(several, title) == 1
    assert has_figure(several, "Film thickness") == 3
    assert "20.0 to 69.4 %" in several.text.replace(
        "\N{NO-BREAK SPACE}", " "
    )  # oil-flow imbalance over the runs


@pytest.mark.usefixtures("without_image_files")
def test_figures_show_error_bars_where_visible():
    run = run_like()
    errors = Figures(car=0.0123, clr=0.0456, h_min=1e-12, h_central=7.1e-9)
    none = errors.scale(0.0)
    cells = GridError(
        car=errors.car, clr=errors.clr, h_min=errors.h_min, h_central=errors.h_central, lean=none
    )
    convergence = replace(
        run.solution.convergence, iteration_error=none, discretisation_error=cells
    )
    run = replace(run, solution=replace(run.solution, convergence=convergence))
    rows = {
        row[0].split(",")[0]: row[1] for row in Page(page.render_page([run])).rows if len(row) > 1
    }
    assert (
        next(value for name, value in rows.items() if name.startswith("Asperity load share"))
        == "54.2 (± not determined)"
    )
    assert (
        next(value for name, value in rows.items() if name.startswith("Contact area ratio"))
        == "37.1 ± 1.2"
    )
    assert (
        next(value for name, value in rows.items() if name.startswith("Central film thickness"))
        == "0.512 (0.505 to 0.519)"
    )
    assert (
        next(value for name, value in rows.items() if name.startswith("Minimum film thickness"))
        == "0.005"
    )


@pytest.mark.usefixtures("without_image_files")
def test_runs_of_equal_roughness_are_not_drawn_over_it():
    parsed = Page(page.render_page([run_like(), run_like()]))
    assert not any(
        "Asperity load and area share" in unquote(image["src"]) for image in parsed.images()
    )
    assert "2 runs, Sq 1.25 µm" in parsed.text


def test_page_is_readable_by_screen_readers(several):
    assert ("html", {"lang": "en"}) in several.tags
    assert all(len(image["alt"]) > 30 for image in several.images())
    assert all("scope" in attributes for tag, attributes in several.tags if tag == "th")
    identifiers = [attributes["id"] for _, attributes in several.tags if "id" in attributes]
    assert len(identifiers) == len(set(identifiers))
    targets = {a["href"][1:] for tag, a in several.tags if tag == "a" and a["href"].startswith("#")}
    assert targets <= set(identifiers)


def test_page_states_method_limits_and_citation(single):
    assert "Filled 0.2\N{NO-BREAK SPACE}% missing cells" in single.text
    for limit in (
        "Cavities are refilled",
        "A snapshot",
        "Isothermal",
        "Newtonian",
        "Perfectly plastic",
        "Stiffness of a",
    ):
        assert limit in single.text
    assert "10.3390/lubricants13020078" in single.text
    assert run_like().case.text in single.text


@pytest.mark.usefixtures("without_image_files")
@pytest.mark.parametrize(
    ("model", "stated", "not_stated"),
    [
        ("unified", "Oil is not conserved.", ("Cavities are refilled.", "Mass-conserving")),
        ("paper", "Oil is not conserved.", ("Cavities are refilled.", "Mass-conserving")),
        ("mixed", "Cavities are refilled.", ("Oil is not conserved.", "Mass-conserving")),
        (
            "conserving",
            "Mass-conserving cavitation.",
            ("Oil is not conserved.", "Cavities are refilled.", "created"),
        ),
    ],
)
def test_limits_state_the_models_oil_balance(model, stated, not_stated):
    text = Page(page.render_page([run_like(f'model = "{model}"\n{CASE}')])).text
    limits = text[text.rindex("\nLimits\n") :]
    assert stated in limits
    assert not any(sentence in limits for sentence in not_stated)
    assert "69.4\N{NO-BREAK SPACE}% of the oil carried through the Hertz zone" in limits


@pytest.mark.usefixtures("without_image_files")
def test_limits_of_several_models_are_each_stated_once():
    runs = [run_like(f'model = "{model}"\n{CASE}') for model in ("mixed", "mixed", "conserving")]
    text = Page(page.render_page(runs)).text
    limits = text[text.rindex("\nLimits\n") :]
    assert limits.count("Cavities are refilled.") == limits.count("Mass-conserving") == 1


@pytest.mark.usefixtures("without_image_files")
def test_limits_depend_on_what_the_run_included():
    thinning = CASE.replace('law = "newtonian"', 'law = "ree-eyring", tau0 = "5 MPa"')
    assert thinning != CASE
    assert "Newtonian." not in Page(page.render_page([run_like(thinning)])).text
    line = CASE.replace(
        "[vibration]", '[vibration]\nstiffness_law = "hertz-line"\nrate = "150 kHz"'
    )
    assert "Stiffness of a sphere" not in Page(page.render_page([run_like(line)])).text


@pytest.mark.usefixtures("without_image_files")
def test_runs_without_contact_oil_or_spectrum_have_a_page():
    smooth = CASE.replace(
        'kind = "gaussian"\nsq = "1.25 um"\ncorrelation_length = "40 um"\nseed = 7', 'kind = "flat"'
    )
    smooth_page = Page(
        page.render_page([run_like(smooth, sq=0.0, clr=0.0, car=0.0, lambda_ratio=None)])
    )
    assert "No spectrum" in smooth_page.text
    assert next(row for row in smooth_page.rows if row[0].startswith("Lambda ratio"))[1] == "–"
    assert next(row for row in smooth_page.rows if row[0].startswith("Contact resonance"))[1] == "–"

    dry = re.sub(r"\[lubricant\].*?(?=\[surface\])", "", CASE, flags=re.DOTALL)
    dry_without_vibration = 'lubricant = "none"\n' + dry.split("[vibration]")[0]
    parsed = Page(
        page.render_page(
            [run_like(dry_without_vibration, lambda_ratio=None, mass_flux_imbalance=0.0)]
        )
    )
    assert "none: dry contact" in parsed.text
    limits = parsed.text[parsed.text.rindex("\nLimits\n") :]
    assert "The contact is dry" in limits
    assert not any(words in limits for words in ("conserv", "refilled", "A snapshot"))
    assert "cavitated" not in unquote(parsed.images()[0]["src"])


def test_every_report_has_its_template():
    folder = Path(base.__file__).parent
    names = re.findall(
        r'render\(\s*"(\S+)"', "".join(path.read_text("utf-8") for path in folder.rglob("page.py"))
    )
    assert len(names) == 8
    assert [name for name in names if not (folder / name).is_file()] == []


def test_the_same_run_gives_the_same_bytes(tmp_path, single):
    out = write_report([run_like(notes=("filled 0.2 % missing cells",))], tmp_path / "report.html")
    assert out.read_text("utf-8") == single.html


def test_page_is_written_completely_or_not_at_all(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    out = tmp_path / "report.html"
    out.write_text("the old one")
    monkeypatch.setattr(page, "render_page", fail)
    with pytest.raises(KeyboardInterrupt):
        write_report([run_like()], out)
    assert out.read_text() == "the old one"
    assert list(tmp_path.iterdir()) == [out]


def test_report_needs_a_run_and_a_folder(tmp_path):
    with pytest.raises(BadInput, match="at least one run"):
        write_report([], tmp_path / "report.html")
    with pytest.raises(BadInput, match="nowhere"):
        write_report([run_like()], tmp_path / "nowhere" / "report.html")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("value", "deviation", "parts"),
    [
        (0.84, 0.024, ("84.0", "± 2.4 %")),
        (0.84, None, ("84.0", "%")),
        (None, None, ("–", "")),
    ],
)
def test_a_tile_separates_deviation_and_unit(value, deviation, parts):
    assert base.tile(quantity("clr"), {"clr": value, "clr_error": deviation})[1:] == parts


def test_a_tile_repeats_the_power_of_ten():
    tile = base.tile(quantity("crfa"), {"crfa": 0.0003172, "crfa_std": 0.00002114})
    assert tile[1:] == ("3.17×10⁻⁴", "± 0.21×10⁻⁴ (m/s²)²/Hz")


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("residual 6.2e-03; tolerance 1e-04", "residual 6.2×10⁻³; tolerance 1×10⁻⁴"),
        ("54.2 % of it at 3461.2 ± 2.3 Hz", "54.2~% of it at 3461.2~±~2.3~Hz"),
        ("3 nm, not 3 nmol", "3~nm, not 3 nmol"),
        ("Sq 1.25 um after 3 us, sq_um", "Sq 1.25~µm after 3 µs, sq_um"),
    ],
)
def test_prose_is_typeset_as_in_print(written, expected):
    assert base.in_print(written) == expected.replace("~", "\N{NO-BREAK SPACE}")


@pytest.mark.usefixtures("without_image_files")
def test_load_on_capped_oil_is_shown():
    html = page.render_page([run_like(capped_oil_load_ratio=0.5)])
    assert "without contact carry 50.0\N{NO-BREAK SPACE}% of the load" in html


# Figures
# -------------------------------------------------------------------------------------------------


MAP = ["x along rolling [µm]", "y across rolling [µm]"]
ROUGH = "composite roughness, Sq [µm]"


def labels_of(exhibit):
    """All axis labels of an exhibit."""
    return [
        label
        for axes in exhibit.figure().axes
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label
    ]


@pytest.mark.parametrize(
    ("draw", "labels"),
    [
        (contact.contact_map, MAP),
        (contact.film_map, [*MAP, "film thickness, h [µm]"]),
        (contact.pressure_map, [*MAP, "contact pressure, p [GPa]"]),
        (contact.roughness_map, [*MAP, "composite roughness height, z [µm]"]),
        (contact.centre_line, ["p [GPa]", "x along rolling [µm]", "h [µm]"]),
        (contact.height_distribution, ["height [µm]", "probability density [1/µm]"]),
        (contact.convergence_history, ["Newton step", "relative size [-]"]),
        (friction_maps.stress_map, [*MAP, "von Mises stress [GPa]"]),
        (
            friction_maps.stress_section,
            ["x along rolling [µm]", "depth [µm]", "von Mises stress [GPa]"],
        ),
        (friction_maps.stress_over_depth, ["depth [µm]", "von Mises stress [GPa]"]),
    ],
)
def test_every_axis_has_a_label_with_its_unit(draw, labels):
    assert labels_of(draw(run_like())) == labels


def test_every_axis_of_friction_and_heat_has_a_label_with_its_unit():
    run = run_like()
    shear = labels_of(friction_maps.traction_map(run, run.friction))
    assert shear == [*MAP, "surface traction [MPa]"]
    temperature_labels = labels_of(friction_maps.temperature_map(run, run.friction, run.heat))
    assert temperature_labels == [*MAP, "surface temperature rise [K]"]
    assert labels_of(friction_maps.temperature_line(run, run.heat)) == [
        "x along rolling [µm]",
        "temperature rise [K]",
    ]


def test_resonance_over_roughness_has_its_full_interval():
    """Including the errors of grid and surfaces, not only that of the fit."""
    points = [
        {**run_like().scalars(), "crf_hz": 2500.0, "crf_low_hz": 2300.0, "crf_high_hz": 2550.0}
    ]
    figure = against_roughness.resonance_against_roughness(points, None).figure()
    (bars,) = [lines for axes in figure.axes for lines in axes.collections]
    (bar,) = bars.get_segments()
    assert bar[:, 1].tolist() == [2300.0, 2550.0]


def test_every_axis_over_roughness_and_frequency_has_a_label_with_its_unit():
    run = run_like()
    points = [run.scalars()]
    assert labels_of(against_roughness.shares_against_roughness(points)) == [ROUGH, "share [%]"]
    assert labels_of(against_roughness.resonance_against_roughness(points, 3800.0)) == [
        ROUGH,
        "CRF [Hz]",
    ]
    assert labels_of(against_roughness.friction_against_roughness(points)) == [ROUGH, "µ"]
    density = labels_of(vibration.spectrum(run.vibration, run.resonance_text()))
    assert density == ["frequency [Hz]", "acceleration density [(m/s²)²/Hz]"]


def test_the_circle_in_the_section_marks_the_largest_stress():
    run = run_like()
    axes = friction_maps.stress_section(run).figure().axes[0]
    (image,), (circle,) = axes.images, axes.get_lines()
    left, right, bottom, top = image.get_extent()
    assert top == 0.0 < bottom  # depth grows downwards
    peak = run.stress.peak
    x, depth = (float(value[0]) for value in circle.get_data())
    assert (x, depth) == pytest.approx((peak.x * 1e6, peak.depth * 1e6))
    pixels = image.get_array()
    row, column = np.unravel_index(pixels.argmax(), pixels.shape)
    assert left + (column + 0.5) / pixels.shape[1] * (right - left) == pytest.approx(x)
    assert (row + 0.5) / pixels.shape[0] * bottom == pytest.approx(depth, abs=0.15 * bottom)


def test_stress_over_depth_is_compared_with_hertz():
    run = run_like()
    axes = friction_maps.stress_over_depth(run).figure().axes[0]
    lines = {line.get_label(): line for line in axes.get_lines()}
    depth, smooth = lines["Hertz (smooth, dry, no friction)"].get_data()
    hertz = run.solution.conditions.hertz
    assert smooth.max() == pytest.approx(0.558 * hertz.p_max * 1e-9, rel=0.03)
    assert 0.4 < depth[smooth.argmax()] * 1e-6 / hertz.half_widths[0] < 1.0
    assert lines["solved"].get_ydata() == pytest.approx(
        run.stress.von_mises.max(axis=(0, 1))[1:] * 1e-9
    )


def test_temperatures_are_cut_through_the_hottest_cell():
    run = run_like()
    axes = friction_maps.temperature_line(run, run.heat).figure().axes[0]
    first, second = (line.get_ydata() for line in axes.get_lines()[:2])
    assert max(first.max(), second.max()) == pytest.approx(run.heat.max_k)


def test_friction_heat_and_stress_are_on_the_page(single):
    rows = {row[0]: row[1] for row in single.rows}
    run = run_like()
    assert (
        next(rows[name] for name in rows if name.startswith("Friction coefficient"))
        == f"{run.friction.coefficient:.4f} (± not determined)"
    )
    assert (
        next(rows[name] for name in rows if name.startswith("Maximum flash temp"))
        == f"{run.heat.max_k:.1f}"
    )
    assert (
        next(rows[name] for name in rows if name.startswith("Maximum von Mises"))
        == f"{run.stress.peak.value * 1e-9:.3f}"
    )
    assert (
        next(rows[name] for name in rows if name.startswith("Boundary friction coefficient"))
        == "0.15"
    )
    assert "bair-winer" in next(
        rows[name] for name in rows if name.startswith("Friction of the film")
    )


@pytest.mark.usefixtures("without_image_files")
def test_pure_rolling_and_failed_friction_are_stated(monkeypatch):
    rolling = Page(page.render_page([run_like(CASE.replace("slip = 0.2", "slip = 0.0"))]))
    assert "both surfaces move at the same speed" in rolling.text
    assert len(rolling.images()) == len(Page(page.render_page([run_like()])).images()) - 3

    def refuse(*_, **__):
        raise AsperityError("friction and temperature did not converge")

    monkeypatch.setattr("asperity.results.derived.friction_and_heat", refuse)
    failed = Page(page.render_page([run_like()]))
    assert "No friction and temperature figures: friction and temperature did not" in failed.text
    assert next(row[1] for row in failed.rows if row[0].startswith("Friction coefficient")) == "–"


@pytest.mark.usefixtures("without_image_files")
def test_thermal_feedback_is_not_listed_as_omitted():
    assert "Isothermal film." in Page(page.render_page([run_like()])).text
    warm = CASE + "[thermal]\nfeedback = true\n"
    assert "Isothermal film." not in Page(page.render_page([run_like(warm)])).text


def test_contact_is_drawn_at_its_position():
    run = run_like()
    solution = run.solution
    in_contact = np.zeros(solution.grid.cells, dtype=bool)
    in_contact[3, 20] = True
    axes = (
        contact.contact_map(replace(run, solution=replace(solution, in_contact=in_contact)))
        .figure()
        .axes[0]
    )
    (image,) = axes.images
    left, right, bottom, top = image.get_extent()
    colours = image.get_array()
    rows, columns = colours.shape[:2]
    (spot,) = np.argwhere(np.all(np.isclose(colours, to_rgb(CONTACT_COLOUR)), axis=2))
    assert image.origin == "lower"
    assert left + (spot[1] + 0.5) / columns * (right - left) == pytest.approx(
        solution.grid.x[3] * 1e6
    )
    assert bottom + (spot[0] + 0.5) / rows * (top - bottom) == pytest.approx(
        solution.grid.y[20] * 1e6
    )


def test_shares_of_a_map_are_those_of_the_cells_drawn():
    run = run_like()
    alt = contact.contact_map(run).alt
    shares = [float(share) for share in re.findall(r"([\d.]+) %", alt)]
    zone = hertz_zone(run.solution.conditions, run.solution.grid)
    assert shares[0] == pytest.approx(100.0 * run.solution.in_contact[zone].mean(), abs=0.051)
    assert shares[2] == pytest.approx(100.0 * run.sharing.cavitated, abs=0.051)
    assert sum(shares) == pytest.approx(100.0, abs=0.11)
    # not those of the run, which may be means over time
    assert contact.contact_map(replace(run, state=replace(run.state, car=0.9))).alt == alt


def test_hertz_is_dashed_with_the_solved_pressure():
    run = run_like()
    solution = run.solution
    upper, lower = contact.centre_line(run).figure().axes
    hertz = next(line for line in upper.lines if "Hertz" in line.get_label())
    assert hertz.get_linestyle() == "--"
    area = np.trapezoid(hertz.get_ydata(), hertz.get_xdata()) * 1e9 * 1e-6
    assert area == pytest.approx(
        solution.conditions.line_load, rel=0.05
    )  # on cells of a fifth of the half-width
    row = int(np.argmin(np.abs(solution.grid.y)))
    np.testing.assert_allclose(lower.lines[0].get_ydata(), solution.gap[:, row] * 1e6)


def test_the_resonance_is_marked_at_its_frequency():
    run = run_like()
    (axes,) = vibration.spectrum(run.vibration, run.resonance_text()).figure().axes
    markers = {
        line.get_label(): line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2
    }
    assert markers["CRF ± 2 std"] == run.vibration.resonance.crf_hz
    assert markers["CRF at full load"] == run.vibration.full_load_crf_hz
    fitted = next(line for line in axes.lines if line.get_label() == "fitted resonance")
    peak = fitted.get_xdata()[np.argmax(fitted.get_ydata())]
    assert peak == pytest.approx(run.vibration.resonance.crf_hz, rel=2e-3)


def test_a_peak_search_has_neither_curve_nor_interval():
    run = run_like(CASE + 'method = "peak"\n')
    (axes,) = vibration.spectrum(run.vibration, run.resonance_text()).figure().axes
    labels = {line.get_label() for line in axes.lines}
    assert "CRF" in labels
    assert "fitted resonance" not in labels


def test_surface_map_is_only_a_png(tmp_path):
    heights = 1e-6 * np.random.default_rng(1).standard_normal((40, 30))
    heights[5, 7] = np.nan
    grid = Grid((40, 30), (0.0, 0.0), (40e-6, 30e-6), (False, False))
    surface = MeasuredSurface(heights, grid, "ring $1$.x3p", "X3P")
    description = SurfaceDescription(
        Path(surface.name), surface, surface, surface_parameters(surface), ()
    )
    out = surface_map(description, tmp_path / "map.png")
    assert out.read_bytes().startswith(b"\x89PNG")
    assert out.read_bytes() == surface_map(description, tmp_path / "again.png").read_bytes()
    with pytest.raises(BadInput, match="png"):
        surface_map(description, tmp_path / "map.jpg")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["again.png", "map.png"]


def test_a_flat_surface_can_be_drawn():
    surface = flat_surface(load_case(CASE).grid)
    assert isinstance(surface, Surface)
    run = run_like()
    flat = replace(run, solution=replace(run.solution, surface=surface))
    assert "perfectly smooth" in svg(contact.height_distribution(flat).figure())
