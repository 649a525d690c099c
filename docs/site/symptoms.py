"""The page of symptoms, with a picture of each: the mistake planted, and the right image beside it."""

from docs.site import layout, words

HERE = "symptoms.html"


def page() -> str:
    """docs/symptoms.md with its pictures."""
    text = (layout.ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    return words.markdown(text, "docs/symptoms.md", HERE)
