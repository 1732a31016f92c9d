"""`gelslim view`: a page in the browser that shows a design, and follows it while it is edited."""

from __future__ import annotations

import webbrowser
from typing import Annotated

import typer

from gelslim.cli.failure import CommandError
from gelslim.cli.options import SpecFile


def view(
    spec: SpecFile,
    watch: Annotated[
        bool, typer.Option("--watch", "-w", help="Follow the file: each save is shown.")
    ] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page; 0 takes a free one.")
    ] = 0,
    open_page: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the browser.")
    ] = True,
) -> int:
    """Show a design in the browser, and follow its file with --watch.

    Dimensions and design rules come at once, what concessions would gain and the solids when they
    are made. A file that cannot be read is told with its lines, and the last design stays. The
    page is served on this machine only, until Ctrl-C.
    """
    from gelslim_cad.live.board import Board
    from gelslim_cad.live.follow import Follower
    from gelslim_cad.live.server import LiveServer
    from gelslim_cad.tolerance.asked import read_spec

    if not spec.is_file():
        read_spec(spec)
    board = Board()
    try:
        server = LiveServer(board, port)
    except OSError as error:
        raise CommandError(
            f"gelslim view: port {port} cannot be used ({error.strerror}); give another --port"
        ) from None
    follower = Follower(spec, read_spec, board)
    follower.start(watch)
    try:
        print(f"{spec} is shown at {server.address} until Ctrl-C.", flush=True)
        if open_page:
            webbrowser.open(server.address)
        server.serve_forever()
    except KeyboardInterrupt:
        print()
    finally:
        follower.stop()
        server.server_close()
    return 0
