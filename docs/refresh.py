"""Writes anew what the README and the pages show: figures, and the output of every command.

python docs/refresh.py [figures] [gallery] [pages]   all by default; takes some minutes
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import first_picture
import gallery
import snippets

ROOT = snippets.ROOT
sys.path.insert(0, str(ROOT))
FIGURES = ROOT / "docs" / "figures"


def figures() -> None:
    """Draw the figures of README and pages into docs/figures."""
    import bristle
    from benchmarks.paper.comparison.make import make as comparison
    from benchmarks.paper.figures import make, paper_figures
    from bristle.engine.view import run_figure

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first_picture.main(folder / "hidden_effect.png")
        run_figure(bristle.run("el_centro_lugre_passive"), folder / "el_centro_lugre_passive.png")
        for figure in paper_figures():
            make(figure, folder)
        summary = comparison(folder / "comparison").folder / "summary.png"
        print(shrunk(summary, FIGURES / "controllers-summary.png"))
        for image in sorted(folder.glob("*.png")):
            print(shrunk(image, FIGURES / image.name))


def shrunk(source: Path, target: Path, width: int = 1500) -> Path:
    """Write an image with fewer pixels and a palette: figures are lines on white."""
    from PIL import Image

    with Image.open(source) as image:
        height = round(image.height * width / image.width)
        small = image.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
        small.quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)
    return target


def pages() -> None:
    """Run the blocks of README and pages and write their output into them."""
    for page in snippets.all_pages():
        print(f"{page.relative_to(ROOT)}: {snippets.run_page(page, update=True)} blocks")


if __name__ == "__main__":
    wanted = sys.argv[1:] or ["figures", "gallery", "pages"]
    if not set(wanted) <= {"figures", "gallery", "pages"}:
        sys.exit(__doc__)
    for task in wanted:
        {"figures": figures, "gallery": gallery.make, "pages": pages}[task]()
