from matplotlib.figure import Figure
from matplotlib.image import imread

from figures import style
from figures.__main__ import write_figure


def test_fonts_are_embedded_as_truetype_and_there_is_no_date(draw, tmp_path):
    pdf, png = (tmp_path / "figures" / f"v1.2.{extension}" for extension in ("pdf", "png"))
    assert write_figure(draw("outliers"), [pdf, png], "A title") == [pdf, png]
    assert b"/FontFile2" in pdf.read_bytes()  # a TrueType font, embedded
    assert b"/CIDFontType2" in pdf.read_bytes()
    assert b"/Type3" not in pdf.read_bytes()
    assert b"CreationDate" not in pdf.read_bytes()
    assert b"A title" in pdf.read_bytes()
    assert b"Software" not in png.read_bytes()
    assert b"A title" in png.read_bytes()
    assert imread(png).shape[1] == 990  # 3.3 inches, 300 dpi


def test_long_labels_are_not_cut_off(tmp_path):
    with style.applied():
        figure = Figure(figsize=(style.PAGE, 1), layout="constrained")
        axes = figure.subplots()
        axes.set_yticks(range(2), ["TAS: largest threshold, units of d", "two pieces (orbit, t)"])
        axes.tick_params(axis="y", labelsize=style.SMALL)
        write_figure(figure, [tmp_path / "figure.png"], "")
    assert (imread(tmp_path / "figure.png")[:, :5, :3] == 1).all()
