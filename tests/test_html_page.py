"""Pages of HTML: what comes from files is text, never markup."""

from html.parser import HTMLParser

from mocaplab import html_page

NASTY = '<script>alert("x")</script> & co'


class Reader(HTMLParser):
    """Collect tags with their attributes, and the text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data


def test_everything_is_escaped():
    sections = [
        html_page.heading(NASTY),
        html_page.paragraph(NASTY),
        html_page.note(NASTY),
        html_page.bullets([NASTY]),
        html_page.table([NASTY], [[NASTY]], words=True),
        html_page.picture(b"png", f'{NASTY} "quoted"'),
    ]
    found = Reader(html_page.page(NASTY, sections))
    assert "script" not in {tag for tag, _ in found.tags}
    assert found.text.count(NASTY) == 7
    image = next(attrs for tag, attrs in found.tags if tag == "img")
    assert image == {"alt": f'{NASTY} "quoted"', "src": "data:image/png;base64,cG5n"}


def test_a_page_loads_nothing():
    found = Reader(html_page.page("title", [html_page.picture(b"", "")]))
    assert not [attrs for _, attrs in found.tags if "http" in str(attrs)]
