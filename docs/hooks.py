"""What the site (mkdocs.yml) adds to docs/: the pages of the repository's root, and the files that pages link to."""

import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
LINK = re.compile(r"\[([^\]]+)\]\(([^)#\s]+)\)")


def on_files(files, config):
    for source, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown, page, config, files):
    """Links are written for readers of the repository; files outside docs/ go into the site as plain text."""
    folder = ROOT if page.file.src_uri in PAGES.values() else ROOT / "docs"

    def link(match):
        words, target = match.groups()
        path = (folder / target).resolve()
        if "://" in target or not path.exists():
            return match[0]  # MkDocs complains of what does not exist
        if path.is_dir():
            return words
        uri = PAGES.get(str(path.relative_to(ROOT))) or f"files/{path.relative_to(ROOT)}.txt"
        if path.is_relative_to(ROOT / "docs"):
            uri = str(path.relative_to(ROOT / "docs"))
        elif uri.startswith("files/") and uri not in files.src_uris:
            files.append(File.generated(config, uri, abs_src_path=str(path)))
        return f"[{words}]({uri})"

    return LINK.sub(link, markdown)
