"""What a page holds is not taken for its markup."""

from alignscores.explorer.document import data_element, document


def test_titles_and_data_hold_any_characters():
    html = document("a < b", "<p>c</p>", styles=("p {}",), scripts=("d();",), data="</script>")
    assert "<title>a &lt; b</title>" in html
    assert r'"\u003c/script>"' in html
    assert html.count("</script>") == 2
    element = data_element("a", ["<b>", 1])
    assert element == '<script type="application/json" id="a">["\\u003cb>",1]</script>\n'


def test_frames_are_allowed_where_they_are_asked_for():
    for allowed in ("", "frame-src blob:"):
        html = document("a", "", styles=(), scripts=(), allowed=allowed)
        assert ("frame-src blob:" in html) == bool(allowed)
