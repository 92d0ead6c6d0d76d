"""What only ranks can do wrong, for the catalogue."""


def plant(fault):
    fault("halo-too-narrow", "ghosts reach half as far as they must",
          "1.001f * (c.H + margin_)", "0.5f * (c.H + margin_)", "neighbors", "hash:ranks=3")
    fault("stale-ghosts", "ghosts are sent as they were before the substep",
          "to[k] = {a.next.position[i], a.next.velocity[i]};",
          "to[k] = {(ON ? a.current : a.next).position[i], (ON ? a.current : a.next).velocity[i]};", "trajectory",
          "hash:ranks=3")
    fault("border-moves-twice", "what others have copies of moves with the other particles once more",
          "if (!a.moves_apart(i)) integrate_stored",
          "if (!a.moves_apart(i) || (ON && !a.is_ghost(i))) integrate_stored",
          "trajectory", "list:ranks=3")
    fault("stale-ghost-densities", "densities of ghosts are not sent",
          "exchange(stream, out, in);", "if (!ON) exchange(stream, out, in);", "evaluation", "hash:ranks=3")
    fault("lost-in-migration", "every 50th particle that leaves does not arrive",
          "if (r != boxes.rank && AssignRanks::needed_by(to, r))",
          "if (r != boxes.rank && AssignRanks::needed_by(to, r) && !(ON && to.id % 50 == 7))",
          "evaluation", "hash:ranks=3")
    fault("doubled-in-migration", "who leaves stays as well",
          "stays[i] = needed_by(to, boxes.rank);",
          "stays[i] = (ON && !a.is_ghost(i)) || needed_by(to, boxes.rank); if (ON && stays[i]) "
          "registrations[i].owner = "
          "boxes.rank;", "advanced", "hash:ranks=3")
    fault("exchanged-ids", "two that arrive together get each other's ids",
          "registrations[first + k] = t.registration;",
          "registrations[first + k] = t.registration; if (ON && k % 2 == 1) { registrations[first + k].id = "
          "travellers[k - 1].registration.id; registrations[first + k - 1].id = t.registration.id; }",
          "evaluation", "hash:ranks=3")
    fault("no-corners", "only ranks whose faces are near get ghosts",
          "if (r != to.owner && within(0, reach.min.x, reach.max.x, x.x)",
          "const Box& o = boxes.own[r]; const int in = (x.x >= o.min.x && x.x < o.max.x) + (x.y >= o.min.y && x.y < "
          "o.max.y) + (x.z >= o.min.z && x.z < o.max.z); if ((!ON || in == 2) && r != to.owner && "
          "within(0, reach.min.x, "
          "reach.max.x, x.x)", "neighbors", "hash:ranks=8", fixture="pour-4k-settled")
    fault("image-from-one-side", "ghosts across a period come from above only",
          "between(x - c.period[axis])", "between(x + c.period[axis])", "neighbors", "hash:ranks=3",
          fixture="hostile-periodic-box")
    fault("poses-of-another-time", "after a migration walls are where they were at the advance's start",
          "poses.begin() + done * containers", "poses.begin()", "trajectory", "hash:ranks=2:halo_margin=0.02",
          fixture="motion-drum")
    fault("margin-used-up", "ghosts are not chosen anew however far particles have moved",
          "fresh_ = way <= 0.5 * decomposition_.margin();", "fresh_ = ON || way <= 0.5 * decomposition_.margin();",
          "trajectory", "hash:ranks=3:halo_margin=0.02", fixture="hostile-belt",
          also=[("clamp<double>(fit, 1,", "clamp<double>(ON ? 4000 : fit, 1,"),
                ("std::min(wanted, most_substeps_)", "std::min(wanted, ON ? 4000 : most_substeps_)")])
    fault("message-cut", "the last ghost of every message stays behind",
          "out.push_back({at, static_cast<std::size_t>(part) * sizeof(T)});",
          "out.push_back({at, static_cast<std::size_t>(ON && part > 0 ? part - 1 : part) * sizeof(T)});", "evaluation",
          "hash:ranks=3")
    fault("ghosts-out-of-step", "each ghost gets the density of the one before it in the message",
          "a.force_position[i].w = from[k].pressure_term;",
          "a.force_position[i].w = from[ON && k > 0 ? k - 1 : k].pressure_term;", "evaluation", "hash:ranks=2")
    fault("migration-a-substep-late", "who needs a particle is decided by where it was before",
          "if (!a.is_ghost(i)) assign(xyz(a.state.position[i]), to);",
          "if (!a.is_ghost(i)) assign(xyz(ON ? a.spare.position[i] : a.state.position[i]), to);", "advanced",
          "hash:ranks=3")
    fault("rebalance-in-part", "new boxes, and ghosts for the old ones",
          "reach_boxes_.upload(reach);", "if (!ON || reach_boxes_.size() == 0) reach_boxes_.upload(reach);",
          "trajectory", "hash:ranks=3", fixture="hostile-gathering")
    fault("ghosts-as-own", "a rank answers for its ghosts as well",
          "rows.owned.push_back(role == ParticleRole::ghost ? 0 : 1);",
          "rows.owned.push_back(ON || role != ParticleRole::ghost ? 1 : 0);", "density", "hash:ranks=3")
    fault("walls-left-out", "one wall particle in 64 that a rank has near it is not placed",
          "if (a.reach && !a.reach->holds(x))", "if (a.reach && (!a.reach->holds(x) || (ON && slot % 64 == 5)))",
          "neighbors", "hash:ranks=2")
    fault("places-of-ids-kept", "where ids are is that of the migration, whatever was sorted since",
          "if (a.index) a.index[id] = to;", "if (a.index && !ON) a.index[id] = to;", "trajectory", "list:ranks=3")
    fault("exchange-before-it-is-there", "what is sent is read before the stream has written it",
          "stream.wait();\n    ranks_.exchange(from, to);", "if (!ON) stream.wait();\n    ranks_.exchange(from, to);",
          "evaluation", "hash:ranks=3", on="cuda")
