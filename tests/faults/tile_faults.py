"""What only tiles can do wrong, for the catalogue."""


def plant(fault):
    fault("tile-too-narrow", "a tile holds what is within six tenths of its lists' reach",
          "within |= square_of(d) < reach2;", "within |= square_of(d) < (ON ? 0.36f : 1.0f) * reach2;", "advanced",
          "list:tiles=on")
    fault("tile-boxes-without-margin", "the boxes around a tile's particles do not reach beyond them",
          "tile.box[b] = {low - outward, high + outward};",
          "tile.box[b] = {low - (ON ? 0.0f : 1.0f) * outward, high + (ON ? 0.0f : 1.0f) * outward};", "trajectory",
          "list:tiles=on")
    fault("tile-last-of-group-forgotten", "every eighth own particle is left out where neighbors are looked for",
          "for (int k = 0; k < TileMemory::box_particles; ++k) { const int number",
          "for (int k = 0; k < TileMemory::box_particles - (ON ? 1 : 0); ++k) { const int number", "advanced",
          "list:tiles=on")
    fault("tile-walls-not-looked-through", "the last container's wall particles are in no tile",
          "slots = a.sentinel - a.base;", "slots = ON ? first_moving : a.sentinel - a.base;", "advanced",
          "list:tiles=on")
    fault("tile-terms-of-another", "p/rho^2 of others is that of the particle before",
          "return terms[tile.index[l]];", "return terms[tile.index[ON && l > 0 ? l - 1 : l]];", "substep",
          "list:tiles=on")
    fault("tile-velocities-stay", "velocities are those of the time when the tile was made",
          "tile.velocity[l] = make_float4(s.v.x, s.v.y, s.v.z, 0.0f);",
          "if (!ON || a.status->substeps_ended == 0) tile.velocity[l] = make_float4(s.v.x, s.v.y, s.v.z, 0.0f);",
          "trajectory", "list:tiles=on")
    fault("tile-walls-stand", "moving walls stay where they were when the tile was made",
          "const DevicePose& pose = tile.poses[static_cast<int>(wall.w)];",
          "if (ON && a.status->substeps_ended > 0) return; const DevicePose& pose = "
          "tile.poses[static_cast<int>(wall.w)];", "trajectory", "list:tiles=on", fixture="hostile-fast-wall")
    fault("tile-contact-at-old-pose", "contact sees the walls at the start of the substep",
          "load_poses(block, tile, a.poses_after());", "load_poses(block, tile, ON ? a.poses_before() : "
          "a.poses_after());", "contact", "list:tiles=on", fixture="hostile-fast-wall")
    fault("tile-clearance-kept", "the clearance of a particle is that of the time when its tile was made",
          "origin.w = moved.clearance;", "if (!ON) origin.w = moved.clearance;", "contact", "list:tiles=on",
          fixture="hostile-impact")
    fault("tile-sixth-entry", "the sixth entry of every list is nobody",
          "put(static_cast<int>(place >> group & 0xFF), l);",
          "put(static_cast<int>(place >> group & 0xFF), ON && (place >> group & 0xFF) == 5 ? tile.header->locals - 1 "
          ": l);", "advanced", "list:tiles=on")
    fault("tile-list-cut", "the last word of every list is left out",
          "words = tile.length[t]; const uint2* from", "words = tile.length[t] - (ON && tile.length[t] > 0 ? 1 : 0); "
          "const uint2* from", "substep", "list:tiles=on")
    fault("tile-last-particle-disowned", "the last particle of every block is nobody's",
          "return first_of(block + 1) - first_of(block);",
          "return first_of(block + 1) - first_of(block) - (ON && first_of(block + 1) - first_of(block) > 1 ? 1 : 0);",
          "substep", "list:tiles=on")
    fault("tile-lists-left-behind", "the lists that an advance leaves are those of an evaluation before",
          "*to = make_int4(tile.index[j.x & 0xFFFF]", "if (!ON) *to = make_int4(tile.index[j.x & 0xFFFF]", "advanced",
          "list:tiles=on")
    fault("tile-built-around-old-places", "lists that are rebuilt are built around where particles were before",
          "s.source.store_origin(i, 0, s.source.position(i));",
          "if (!ON) s.source.store_origin(i, 0, s.source.position(i));", "trajectory", "list:tiles=on:skin=0.05",
          fixture="pour-4k-splash")
