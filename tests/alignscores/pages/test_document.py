"""Content of a page is never markup."""

from alignscores.pages.document import data_element, document


def test_titles_and_data_hold_any_characters():
    html = document("a < b", "<p>c</p>", styles=(), scripts=("scores.js",), data="</script>")
    assert "<title>a &lt; b</title>" in html
    assert r'"\u003c/script>"' in html
    assert html.count("</script>") == 2
    element = data_element("a", ["<b>", 1])
    assert element == '<script type="application/json" id="a">["\\u003cb>",1]</script>\n'
