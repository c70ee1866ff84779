#!/usr/bin/env python3
"""The same pictures here and in other renderers, in turns: see README.md beside this file."""
import argparse
import json

import in_cycles
import in_mitsuba
import in_povray
import ours
from common import add_flags, in_turns, installed, parsed, write_ply
from scenes import scenes

PEERS = {"mitsuba": in_mitsuba.run, "cycles": in_cycles.run, "povray": in_povray.run}
# POV-Ray has no path tracer to set against ours.
UNABLE = {("povray", "cornell")}


def write(args, name, scene):
    """The scene in everyone's words."""
    meshes = []
    for i, (mesh, material) in enumerate(scene["meshes"]):
        meshes.append(("%s%d.ply" % (name, i), material))
        write_ply("%s/%s" % (args.folder, meshes[i][0]), mesh)
    with open("%s/%s.json" % (args.folder, name), "w") as f:
        json.dump(dict(scene, meshes=meshes), f)
    ours.write(args.folder, name, scene, args.samples)
    in_povray.write(args.folder, name, scene)


def main():
    known = scenes()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="*", help=" ".join(known) + "; all if none is named")
    parser.add_argument("--peer", action="append", choices=PEERS, help="may be repeated; all if none is named")
    add_flags(parser)
    args = parsed(parser)
    for name in args.scene:
        if name not in known:
            parser.error("there is no scene `%s`, only %s" % (name, ", ".join(known)))
    peers = installed({name: PEERS[name] for name in args.peer or PEERS})
    print("%-8s %-8s %9s %9s %9s %7s %7s %7s" % ("scene", "", "render s", "wall s", "cpu s", "render", "wall", "cpu"))
    for name in args.scene or known:
        write(args, name, known[name])
        able = {who: run for who, run in peers.items() if (who, name) not in UNABLE}
        runners = {who: lambda run=run: run(args, name) for who, run in dict(anim=ours.run, **able).items()}
        times = in_turns(runners, args.runs)
        for who, seconds in times.items():
            # Ours over theirs: below 1 is faster.
            ratios = [a / b for a, b in zip(times["anim"], seconds)]
            print(("%-8s %-8s" + 3 * " %9.3f" + 3 * " %7.3g") % (name, who, *seconds, *ratios), flush=True)


main()
