"""The elements of an SVG file, in whatever encoding it declares."""

from xml.parsers import expat

from ..errors import InputError
from .svg_style import Element

_LONGEST = 1000  # letters of an entity
_SPACES = {
    "http://www.w3.org/2000/svg": "",
    "http://www.w3.org/1999/xlink": "xlink:",
    "http://www.inkscape.org/namespaces/inkscape": "inkscape:",
    "http://www.w3.org/XML/1998/namespace": "xml:",
}


def parsed(content: bytes) -> tuple[Element | None, str]:
    """The root element, in whatever encoding the file declares, and a style sheet that it links.

    Entities are read in attributes only, where Illustrator puts the names of its namespaces, and only plain ones.

    Raises:
        InputError: if it has other entities or too many levels. ExpatError, ValueError, LookupError: if it is no XML.
    """
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    stack: list[Element] = []
    roots: list[Element] = []
    linked: list[str] = []

    def short(name: str) -> str:
        space, _, local = name.rpartition(" ")
        return local if not space else _SPACES.get(space, "other:") + local

    def start(name: str, attributes: dict[str, str]) -> None:
        if len(stack) >= 500:
            raise InputError("the drawing has at most 500 levels")
        parent = stack[-1] if stack else None
        named = {short(key): value for key, value in attributes.items()}
        element = Element(short(name), named, parser.CurrentLineNumber, parent)
        (parent.children if parent else roots).append(element)
        stack.append(element)

    def text(data: str) -> None:
        if stack and stack[-1].tag == "style":
            stack[-1].text += data

    def entity(name: str, parameter: int, value: str | None, *_: object) -> None:
        if parameter or value is None or len(value) > _LONGEST or set("&%<") & set(value):
            raise InputError("entities in drawings are not read unless they are plain text", value=name)

    def other(data: str) -> None:
        if data.startswith("&"):
            raise InputError("entities in drawings are only read in attributes", value=data)

    def instruction(target: str, data: str) -> None:
        if target == "xml-stylesheet":
            linked.append(data)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = entity
    parser.DefaultHandler = other  # with it, entities between tags come here and are not replaced
    parser.ProcessingInstructionHandler = instruction
    parser.Parse(content, True)
    return (roots[0] if roots else None), "; ".join(linked)
