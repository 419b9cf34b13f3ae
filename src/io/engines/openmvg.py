"""Places the photographs of a folder: find_cameras.py PICTURES OUT. Writes OUT/sparse/0."""

import os
import re
import sys
import threading
import time


def end_with_parent():
    """Nobody waits for the result once the program that asked for it has gone."""
    parent = os.getppid()
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)


def follow(stream):
    """openmvg-rs draws bars on a terminal; each count becomes a line."""
    last, rest = None, b""
    while True:
        try:
            read = os.read(stream, 65536)
        except OSError:
            return
        if not read:
            return
        rest = (rest + read)[-65536:]
        *lines, rest = re.split(rb"[\r\n]", rest)
        for line in lines:
            text = re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", line.decode("utf-8", "replace"))
            found = re.match(r"\s*([A-Z][A-Za-z ]+?)\s*\[.*\]\s*(\d+)/(\d+)", text)
            told = f"step: {found[1]} [{found[2]}/{found[3]}]" if found else text.strip()
            if told and told != last:
                print(told, flush=True)
            last = told


def main():
    threading.Thread(target=end_with_parent, daemon=True).start()
    import openmvg_rs

    try:
        import fcntl
        import pty
        import struct
        import termios

        own, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 200, 0, 0))
        os.environ.setdefault("TERM", "xterm")
        os.dup2(terminal, 2)
        threading.Thread(target=follow, args=(own,), daemon=True).start()
    except ImportError:
        pass
    scene = openmvg_rs.reconstruct(sys.argv[1])
    print(scene, flush=True)
    scene.write_colmap(sys.argv[2])


try:
    main()
except Exception as error:  # told in one line; the caller says what to do
    print(f"error: {type(error).__name__}: {error}", flush=True)
    sys.exit(3)
