#!/usr/bin/env python3
"""The lighting study of scripts/mixing.rhai here and in other renderers, in turns: see README.md beside this file."""
import argparse
import os

import in_cycles
import in_mitsuba
import in_povray
import ours
from common import add_flags, in_turns, installed, parsed, write_ply
from studio import FRAMES, cone, pebble

PEERS = {"mitsuba": in_mitsuba.run_study, "cycles": in_cycles.run_study, "povray": in_povray.run_study}


def reckoned(run, args):
    """Seconds for all frames, from the first one and what some more cost."""
    if args.peer_frames == FRAMES:
        return run(args, FRAMES)
    first, some = run(args, 1), run(args, args.peer_frames)
    return tuple(a + (b - a) * (FRAMES - 1) / (args.peer_frames - 1) for a, b in zip(first, some))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", action="append", choices=PEERS, help="may be repeated; all if none is named")
    parser.add_argument("--peer-frames", type=int, default=FRAMES,
                        help="frames that peers render, 2 to %d; the rest is reckoned" % FRAMES)
    add_flags(parser)
    args = parsed(parser)
    if not 2 <= args.peer_frames <= FRAMES:
        parser.error("--peer-frames must be 2 to %d" % FRAMES)
    peers = installed({name: PEERS[name] for name in args.peer or PEERS})
    for name in ("anim", *peers):
        os.makedirs(os.path.join(args.folder, name), exist_ok=True)
    in_povray.write_study(args.folder)
    for name, mesh in {"cone": cone(256), "pebble": pebble(128)}.items():
        write_ply("%s/%s.ply" % (args.folder, name), mesh)
    runners = {who: lambda run=run: reckoned(run, args) for who, run in peers.items()}
    times = in_turns(dict(anim=lambda: ours.run_study(args), **runners), args.runs)
    print("%-8s %9s %9s %7s %7s" % ("", "wall s", "cpu s", "wall", "cpu"))
    for who, seconds in times.items():
        # Ours over theirs, as in peers.py.
        ratios = [a / b for a, b in zip(times["anim"], seconds)]
        print("%-8s %9.2f %9.2f %7.3g %7.3g" % (who, *seconds, *ratios))


main()
