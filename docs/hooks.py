"""Hooks of the site (mkdocs.yml): add the pages of the repository's root and of the commands, and files linked to."""

import re
from pathlib import Path

from commands import commands_page
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
LINK = re.compile(r"\[([^\]]+)\]\(([^)#\s]+)(#[^)\s]+)?\)")


def on_files(files, config):
    for source, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    files.append(File.generated(config, "cli.md", content=commands_page()))
    return files


def on_page_markdown(markdown, page, config, files):
    """Rewrite links, which are relative to the repository; linked files outside docs/ become plain-text files."""
    folder = ROOT if page.file.src_uri in PAGES.values() else ROOT / "docs"

    def site_link(match):
        text, target, anchor = match.groups(default="")
        path = (folder / target).resolve()
        if "://" in target or not path.exists():
            return match[0]  # MkDocs warns of targets that do not exist
        if path.is_dir():
            return text
        uri = PAGES.get(str(path.relative_to(ROOT))) or f"files/{path.relative_to(ROOT)}.txt"
        if path.is_relative_to(ROOT / "docs"):
            uri = str(path.relative_to(ROOT / "docs"))
        elif uri.startswith("files/") and uri not in files.src_uris:
            files.append(File.generated(config, uri, abs_src_path=str(path)))
        return f"[{text}]({uri}{anchor})"

    return LINK.sub(site_link, markdown)
