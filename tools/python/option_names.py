"""Names of backend options: what files measured by version 0.1 say, in today's words."""

RENAMED = {
    "grid=all": "wall_cells=on", "grid=fluid": "wall_cells=off",
    "source=frame": "moving_walls=body_frame", "source=rebuilt": "moving_walls=rebuilt",
    "pairs=keep": "force_neighbors=cached", "pairs=rescan": "force_neighbors=recomputed",
    "trigger=global": "criterion=displacement", "trigger=local": "criterion=relative",
    "verify=on": "check_completeness=on", "launch=graphs": "launch=graph", "launch=plain": "launch=stream",
}


def current(options):
    """"grid=fluid:skin=0.1" -> "wall_cells=off:skin=0.1"."""
    items = [RENAMED.get(item, item) for item in options.split(":") if item]
    return ":".join(item.replace("lanes=", "threads_per_particle=") if item.startswith("lanes=") else item
                    for item in items)
