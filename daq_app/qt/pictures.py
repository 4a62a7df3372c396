"""Pictures of the analysis and of the finger: shown, compared, and saved; a history also as a film."""

import io
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
from PySide6.QtCore import QBuffer, QPoint, QRect, Qt
from PySide6.QtGui import QImage, QPainter, QPaintEvent, QPixmap
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QApplication, QFileDialog, QProgressDialog, QPushButton, QSizePolicy, QWidget

from daq_app.analyst.finger_words import MEAN_PANELS, ComparisonRows
from daq_app.qt.finger_canvas import FingerCanvas
from daq_app.qt.layout import hbox, vbox
from daq_app.qt.painting import paint_fitted
from daq_app.qt.parts import button, label, set_text
from daq_app.qt.tables import TextTable
from daq_app.qt.tokens import GRID
from daq_app.wording import tr, tr_noop
from sessions.file_access import write_whole
from sessions.strokes.stroke import digits

_FILE_FORMATS = ("SVG", "PNG", "CSV")
Save = Callable[[str, str], object]  # name of a picture, and the path to write it to
_DENSITY = 2.0  # pixels of a saved picture per pixel of the window [-]
_STEP_MS = 100  # duration of each state in a film, as in the window at normal speed [ms]
_LOOK = 0.02  # between two polls of a film being written [s]
_COLOURS = 256  # of a GIF frame: the format's maximum
FILM_SUFFIXES = (".gif", ".mp4")
NO_MP4 = tr_noop("MP4 needs the package imageio-ffmpeg: pip install 'daq-app[film]', or save the film as GIF")


class SaveButtons(QWidget):
    """Buttons that save a picture by its name."""

    def __init__(self, subject: str, save: Save) -> None:
        super().__init__()
        self._name, self._save = "", save
        self.buttons = [
            button(suffix, tr("save {what} as {kind}", what=subject, kind=suffix), partial(self._ask, suffix), "small")
            for suffix in _FILE_FORMATS
        ]
        hbox(1, *self.buttons, on=self, spacing=GRID // 2)
        self.set_name("")

    def set_name(self, name: str) -> None:
        self._name = name
        for widget in self.buttons:
            widget.setEnabled(bool(name))

    def _ask(self, file_format: str) -> None:
        suffix = f".{file_format.lower()}"
        file_name = self._name.replace(" ", "-") + suffix
        path, _ = QFileDialog.getSaveFileName(self, tr("Save as {kind}", kind=file_format), file_name)
        if path:
            self._save(self._name, path if path.lower().endswith(suffix) else path + suffix)


class PictureView(QWidget):
    """A picture made for paper."""

    def __init__(self, subject: str, save: Save) -> None:
        super().__init__()
        self._canvas = _Canvas()
        self.save = SaveButtons(subject, save)
        vbox((self._canvas, 1), self.save, on=self)

    def show_picture(self, name: str, title: str, png: bytes) -> None:
        """Show a picture from its PNG; if that is empty, `title` says why."""
        self._canvas.show_png(png, title)
        self._canvas.setAccessibleName(title)
        self.setAccessibleName(title)
        self.save.set_name(name if png else "")


class _Canvas(QWidget):
    """Paints a picture as large as fits with its proportions, in its own colours, which are made for paper."""

    def __init__(self) -> None:
        super().__init__()
        self._picture, self._text = QPixmap(), ""
        self.setMinimumSize(160, 200)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_png(self, content: bytes, text: str) -> None:
        self._picture.loadFromData(content)
        self._text = text
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        if self._picture.isNull():
            painter.drawText(self.rect(), self._text)
        else:
            paint_fitted(painter, self._picture)


class ComparedView(QWidget):
    """Offers to open a second session, and shows the comparison."""

    def __init__(self, choose: Callable[[], object], save: Save) -> None:
        super().__init__()
        self.names_label = label("", "quiet", wrap=True)
        self.choose = button(tr("Compare with…"), tr("compare with another session"), choose)
        columns = (tr("stimulus"), *(f"{tr(name)} {suffix}" for name in MEAN_PANELS for suffix in ("A", "B", "B − A")))
        self.table = TextTable(tr("two sessions compared"), columns)
        self.table.setMinimumHeight(130)
        self.picture = PictureView(tr("the picture of both sessions"), save)
        vbox(hbox((self.names_label, 1), self.choose), (self.table, 1), (self.picture, 2), on=self, margins=GRID)
        self.show_rows((), ("", ""))

    def show_rows(self, rows: ComparisonRows, sessions: tuple[str, str]) -> None:
        visible = bool(sessions[1])
        names = "\n".join(f"{name}: {session}" for name, session in zip("AB", sessions, strict=True))
        set_text(self.names_label, names if visible else tr("No second session is open."))
        self.table.setVisible(visible)
        self.picture.setVisible(visible)
        lines: list[tuple[str, ...]] = []
        for stimulus, pairs in rows:
            cells = [stimulus]
            for name, (first, second) in zip(MEAN_PANELS, pairs, strict=True):
                places = 1 if name == "score" else 3
                difference = None if first is None or second is None else second - first
                means = (first, ""), (second, ""), (difference, "+")
                cells += ["–" if mean is None else digits(mean, places, sign) for mean, sign in means]
            lines.append(tuple(cells))
        self.table.show_lines(tuple(lines))


def write_picture(canvas: FingerCanvas, heading: str, path: Path) -> None:
    """Write the content of `canvas` by suffix: `.svg`, `.csv`, else PNG, below a `heading`. Raises OSError."""
    buffer = QBuffer()
    match path.suffix.lower():
        case ".csv":
            frame, field = canvas.frame, canvas.look.field
            rows = io.StringIO()
            if frame is not None:
                table = np.column_stack([frame.nodes, field.values_of(frame)])
                rows.writelines(f"# {line}\n" for line in (*heading.split("\n"), canvas.accessibleName()) if line)
                np.savetxt(rows, table, "%.9g", ",", header=f"x [mm],y [mm],{field.axis}", comments="")
            buffer.setData(rows.getvalue().encode())
        case ".svg":
            drawing = QSvgGenerator()
            drawing.setOutputDevice(buffer)
            drawing.setSize(canvas.size_with(heading))
            drawing.setViewBox(QRect(QPoint(), canvas.size_with(heading)))
            drawing.setTitle(canvas.accessibleName())
            canvas.draw(QPainter(drawing), heading)
        case _:
            _image(canvas, _DENSITY, heading).save(buffer, "PNG")  # pyrefly: ignore[no-matching-overload]
    write_whole(path, bytes(buffer.data().data()))


def _image(canvas: FingerCanvas, density: float, heading: str) -> QImage:
    image = QImage(canvas.size_with(heading) * density, QImage.Format.Format_RGB888)
    image.setDevicePixelRatio(density)
    canvas.draw(QPainter(image), heading)
    return image


def write_film(canvas: FingerCanvas, heading: str, show: Callable[[int], None], count: int, path: Path) -> str:
    """Write `count` states that `show` puts on `canvas` below a `heading`; return a message with the path, or why not.

    The suffix decides between MP4 and GIF (default). The window keeps running behind a dialog that can cancel.
    """
    dialog = QProgressDialog(tr("Writing the film"), "", 0, count + 1, canvas.window(), minimumDuration=0)
    cancel = QPushButton(tr("Cancel"))
    cancel.setAccessibleName(tr("cancel the film"))
    dialog.setCancelButton(cancel)
    dialog.setWindowModality(Qt.WindowModality.WindowModal)
    frames: list[Image.Image] = []
    try:
        for index in range(count):
            dialog.setValue(index)
            QApplication.processEvents()
            if dialog.wasCanceled():
                return tr("The film was cancelled: {path} was not written.", path=path)
            show(index)
            image = _image(canvas, 1.0, heading)
            size = (image.width(), image.height())
            picture = Image.frombytes("RGB", size, bytes(image.constBits()), "raw", "RGB", image.bytesPerLine())
            gif = path.suffix.lower() != ".mp4"
            frames.append(picture.quantize(_COLOURS, Image.Quantize.FASTOCTREE) if gif else picture)
        dialog.setValue(count)
        dialog.setCancelButton(None)
        with ThreadPoolExecutor(1) as pool:
            future = pool.submit(_write_film, path, frames)
            while wait([future], _LOOK).not_done:
                QApplication.processEvents()
        if error := future.exception():
            return tr("The film could not be written: {error}", error=error)
        return tr("Saved: {path}", path=path)
    finally:
        dialog.close()
        dialog.deleteLater()


def _write_film(path: Path, frames: list[Image.Image]) -> None:
    """Write the film completely or not at all."""
    if path.suffix.lower() == ".mp4":
        write_whole(path, _mp4(frames))
        return
    content = io.BytesIO()
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:], duration=_STEP_MS, loop=0)
    write_whole(path, content.getvalue())


def _mp4(frames: list[Image.Image]) -> bytes:
    """Return an MP4 (H.264) that every browser plays. Raises ImportError if the encoder is not installed."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError as error:
        raise ImportError(tr(NO_MP4)) from error
    width, height = (length - length % 2 for length in frames[0].size)  # the format shares colours between 2 x 2 pixels
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{1000 / _STEP_MS:g}", "-i", "-"]
    codec = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
    pixels = b"".join(frame.crop((0, 0, width, height)).tobytes() for frame in frames)
    with TemporaryDirectory() as folder:  # an MP4 needs seeking, so a pipe does not work
        film = Path(folder) / "film.mp4"
        encoder = [get_ffmpeg_exe(), "-loglevel", "error", *source, *codec, str(film)]
        result = subprocess.run(encoder, input=pixels, capture_output=True, check=False)
        if result.returncode != 0:
            raise OSError(f"the encoder stopped: {result.stderr.decode(errors='replace').strip()[:200]}")
        return film.read_bytes()
