"""A page in a real browser, 360 and 1920 px wide and as on A4: what is seen, what is asked for, what fails."""

import json
import re
import shutil
import subprocess
from html import escape
from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-features=NetworkTimeServiceQuerying,OptimizationHints,MediaRouter",
)
# A request of the page itself has an origin; what the browser asks for of its own accord has none.
OF_THE_PAGE = re.compile(r'"initiator":"(?!not an origin)[^\n]*?"url":"([a-z]+://[^"]*)"')
PAPER = 680  # width of A4 between the page's margins [CSS px]
PAPER_HEIGHT = 1001  # likewise [CSS px]

MEASURE = Path(__file__).with_name("page_measure.js").read_text(encoding="utf-8")


def open_page(room, text):
    """Open a page three times, 360 and 1920 px wide and as on paper.

    Return what is seen of each, what the console says, and every address the page asks for.
    """
    paper_text = text.replace("@media print", "@media all")
    frames = "".join(
        f'<iframe id="{name}" style="width: {width}px; height: 900px; border: 0" srcdoc="{escape(page_text)}"></iframe>'
        for name, width, page_text in (("narrow", 360, text), ("wide", 1920, text), ("paper", PAPER, paper_text))
    )
    (room / "page.html").write_text(f"<pre></pre>{frames}<script>{MEASURE}</script>", encoding="utf-8")
    process = subprocess.run(
        [
            CHROMIUM,
            *FLAGS,
            f"--user-data-dir={room / 'profile'}",
            f"--log-net-log={room / 'net.json'}",
            "--enable-logging=stderr",
            "--hide-scrollbars",
            "--window-size=2000,1000",
            "--dump-dom",
            (room / "page.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
    )
    document = json.loads(re.search(r"<pre>(\{.*?\})</pre>", process.stdout, re.DOTALL)[1].replace("&amp;", "&"))
    addresses = set(OF_THE_PAGE.findall((room / "net.json").read_text(errors="replace")))
    foreign = {address for address in addresses if not address.startswith("file:")}
    return document, [line for line in process.stderr.splitlines() if "CONSOLE" in line], foreign
