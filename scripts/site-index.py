"""README.md as the first page of the site: its links into docs/ become links between pages."""

from pathlib import Path

from mkdocs.structure.files import File

README = Path(__file__).resolve().parent.parent / "README.md"


def on_files(files, config):
    """Adds index.md, made from README.md."""
    text = README.read_text(encoding="utf-8").replace("](docs/", "](")
    files.append(File.generated(config, "index.md", content=text))
    return files
