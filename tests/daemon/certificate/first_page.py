"""Text of the first page of an HTML file as rendered by weasyprint: first_page.py FILE"""

import sys

from weasyprint import HTML


def texts(box):
    if getattr(box, "text", None) is not None:
        yield box.text
    for child in getattr(box, "children", None) or []:
        yield from texts(child)


print(" ".join(texts(HTML(sys.argv[1]).render().pages[0]._page_box)))
