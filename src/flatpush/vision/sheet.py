"""A tag to print to scale, with a ruler that tells whether the printer kept it."""

from dataclasses import dataclass

from ..errors import InputError
from .tags import BLACK, WHOLE, cells

# A4, and margins, in mm.
PAGE = (210.0, 297.0)
MARGIN, BELOW, TICK = 15.0, 12.0, 4.0
POINTS = 72 / 25.4  # a mm in PDF's unit


@dataclass(frozen=True)
class Sheet:
    """A page, in mm from its upper left corner.

    Attributes:
        boxes: black rectangles, left, top, width and height. texts: left, baseline, height of the letters, and words.
    """

    boxes: tuple[tuple[float, float, float, float], ...]
    texts: tuple[tuple[float, float, float, str], ...]


def sheet(number: int, size: float) -> Sheet:
    """A page with a tag and a ruler.

    Args:
        number: of the tag. size: side of its black border [m].

    Raises:
        InputError: for a number that no tag has, and a tag that does not fit on the page or is too small to print.
    """
    mm = 1000 * size
    cell = mm / BLACK
    most = (PAGE[0] - 2 * MARGIN) * BLACK / WHOLE
    if not 5 <= mm <= most:
        raise InputError(f"a printed tag is 5 to {most:.0f} mm large", key="size", value=f"{mm:g} mm")
    white = cells(number)
    left, top = 0.5 * (PAGE[0] - WHOLE * cell), MARGIN + 10
    boxes = []
    for row in range(WHOLE):
        column = 0
        while column < WHOLE:  # a run of black cells is one box: no seams
            if white[row, column]:
                column += 1
                continue
            end = column
            while end < WHOLE and not white[row, end]:
                end += 1
            boxes.append((left + column * cell, top + row * cell, (end - column) * cell, cell))
            column = end
    # Rows overlap by a hair, so that no viewer shows a seam between them.
    boxes = [(x, y, w, h + (0.01 if y + h < top + (WHOLE - 1) * cell - 1e-9 else 0)) for x, y, w, h in boxes]
    ruler = top + WHOLE * cell + BELOW
    start = 0.5 * (PAGE[0] - 100)
    boxes.append((start, ruler, 100.0, 0.2))
    for k in range(101):
        high = TICK if k % 10 == 0 else TICK * (0.7 if k % 5 == 0 else 0.4)
        boxes.append((start + k - 0.05, ruler - high, 0.1, high))
    texts = [(start + 10 * k - 1, ruler + 4, 2.5, str(10 * k)) for k in range(11)]
    texts.append(
        (
            start,
            ruler + 12,
            3.5,
            f"tag36h11 no. {number}: the black square is {mm:g} mm wide; print at 100 %, and measure.",
        )
    )
    texts.append((start, ruler + 18, 3.5, "The ruler is 100 mm long. Keep the white rim; glue it flat."))
    texts.append((left + 0.5 * WHOLE * cell - 5, top - 2, 2.5, "y up"))
    return Sheet(tuple(boxes), tuple(texts))


def as_svg(page: Sheet) -> str:
    """The page as an SVG whose unit is the mm."""
    w, h = PAGE
    boxes = "".join(
        f'<rect x="{x:.4f}" y="{y:.4f}" width="{a:.4f}" height="{b:.4f}"/>\n' for x, y, a, b in page.boxes
    )
    texts = "".join(
        f'<text x="{x:g}" y="{y:g}" font-size="{s:g}" font-family="Helvetica, Arial, sans-serif">{words}</text>\n'
        for x, y, s, words in page.texts
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{w:g}mm" height="{h:g}mm" viewBox="0 0 {w:g} {h:g}">\n'
        f'<rect width="{w:g}" height="{h:g}" fill="white"/>\n{boxes}{texts}</svg>\n'
    )


def as_pdf(page: Sheet) -> bytes:
    """The page as a PDF, to scale."""
    w, h = (POINTS * side for side in PAGE)
    lines = [
        f"{POINTS * x:.4f} {h - POINTS * (y + b):.4f} {POINTS * a:.4f} {POINTS * b:.4f} re"
        for x, y, a, b in page.boxes
    ]
    lines.append("f")
    for x, y, size, words in page.texts:
        safe = words.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        lines.append(f"BT /F {POINTS * size:.3f} Tf {POINTS * x:.3f} {h - POINTS * y:.3f} Td ({safe}) Tj ET")
    content = "\n".join(lines).encode("latin-1")
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        b"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.4f %.4f] /Contents 4 0 R"
        b" /Resources << /Font << /F 5 0 R >> >> >>" % (w, h),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    found, places = bytearray(b"%PDF-1.4\n"), []
    for k, one in enumerate(objects):
        places.append(len(found))
        found += b"%d 0 obj\n%s\nendobj\n" % (k + 1, one)
    table = len(found)
    found += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    found += b"".join(b"%010d 00000 n \n" % place for place in places)
    found += b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, table)
    return bytes(found)
