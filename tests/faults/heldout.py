"""Wrong backends, written by reading gpu/ and the physics alone, without knowing what any check looks at:
they ask whether the checks find faults that nobody had in mind when the checks were written.

Format as in catalogue.py, but no check and no field is named: any failure counts. `shows` names a scene or a
state for which results differ by more than rounding; "maybe equivalent" marks honest doubt. Planted with
plant.py GPU_FOLDER OUT --catalogue heldout.
"""

HELDOUT = []


# What shows with a backend's options only.
OPTIONS = {
    "list-origins-not-predicted": "list:skin=0.2",
    "clearance-of-last-container": "list:criterion=relative",
    "largest-component-of-approach": "list:criterion=relative",
    "negative-floats-misordered": "list:criterion=relative",
    "ids-permuted-in-place": "hash:sort=thrust",
    "rebuilt-walls-misplaced": "hash:moving_walls=rebuilt",
    "wall-pairs-of-fluid": "list:check_completeness=on",
    "overflow-within-a-word-unreported": "hash:capacity=8",
    "regrown-without-ids": "list:capacity=8",
    "prefetch-one-word-short": "list:threads_per_particle=1",
    "recorded-build-not-woken": "list:launch=graph",
    "skin-as-share-of-h": "list:rebuild=2:skin=0.2",
}


def fault(name, what, find, put, on="both", also=(), file=None, shows=""):
    entry = dict(name=name, what=what, changes=[(find, put, file), *also], on=on, shows=shows)
    if name in OPTIONS:
        entry["backend"] = OPTIONS[name]
    HELDOUT.append(entry)


# Formulas.
fault("period-of-another-axis", "the nearest image along y counts periods of x",
      "d.y * c.inverse_period[1]", "d.y * c.inverse_period[0]",
      shows="a scene periodic along y and free along x, or whose periods differ by a factor of two: pairs "
            "across the y faces are lost")
fault("mueller-viscosity-unclamped", "mueller2003's L is negative beyond H instead of 0",
      "c.g_norm * positive(c.H - d.r)", "c.g_norm * (c.H - d.r)",
      shows="mueller2003 with list: entries between H and H + skin contribute; hash and brute force never visit "
            "such pairs")
fault("mueller-pressure-over-zero", "mueller2003's G divides by r without a guard",
      "c.g_norm * s * s * d.inverse", "c.g_norm * s * s / d.r",
      shows="mueller2003 with two particles in the same place: infinity times zero")
fault("tension-whenever-linear", "pressure is clamped at 0 only for exponent 7",
      "c.allow_tension || !(p < 0.0f) ? p : 0.0f",
      "c.allow_tension || c.eos_exponent == 1 || !(p < 0.0f) ? p : 0.0f",
      shows="eos_exponent 1 with allow_tension false, any particle below rest density (free surface)")
fault("always-seventh-power", "the exponent of the equation of state is read by its stiffness alone",
      "c.eos_exponent == 7", "true",
      shows="eos_exponent 1: pressures are about 7 times too large away from rest density")

# Arrays and status.
fault("finite-test-without-z", "a vector counts as finite whatever its z is",
      "fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f", "fabsf(v.y) <= 3.0e38f",
      shows="a state with one NaN, in z: evaluate reports nothing, advance calls it escaped")
fault("poses-of-one-container", "the poses of a substep are found as if there were one container",
      "static_cast<std::size_t>(substep) * static_cast<std::size_t>(containers)",
      "static_cast<std::size_t>(substep)",
      shows="two containers or more, from the end of the first substep on; one container hides it")
fault("status-without-substep", "which substep a particle failed in is not kept",
      "static_cast<unsigned long long>(substep) << 32", "0ull",
      shows="a particle that leaves the domain in the third substep of an advance: only the status is wrong")

# Cells.
fault("row-around-end-one-short", "a row that goes around the table's end misses its last cell",
      "start[at + spill]", "start[at + spill - 1]",
      shows="hash or list, fluid near a periodic face along x, or a spray wider than the table")
fault("period-cells-rounded-up", "a period is cut into cells narrower than the reach",
      "std::floor(period / cell)", "std::ceil(period / cell)",
      shows="hash, period along y or z of 4.5 H: cells are 0.9 H wide and pairs two cells apart are lost")
fault("other-cell-visited-twice", "an axis of two cells visits the other cell from both sides",
      "wrap[axis] >= 3", "wrap[axis] >= 2",
      shows="a period along y or z of 3 H (hash) or of 3 to 3.6 H (list): pairs are counted twice")
fault("cell-clamped-below-period", "a position just below a periodic face goes into the first cell, not the last",
      "rest < 0 ? rest + wrap[axis] : rest", "c < 0 ? 0 : rest",
      shows="list, particles that move fast through a lower periodic face: predicted positions lie below it, and "
            "neighbors nearly H away that approach are lost")

# Wall particles.
fault("force-walls-at-next-pose", "the persistent kernel places walls for forces at the end of the substep",
      "what == WallsFor::force ? a.poses_before() : a.poses_after()", "a.poses_after()",
      shows="list with its default launch and a tilting container: wall forces see the next substep's walls")
fault("volume-by-cubic-kernel", "wall volumes use the cubic spline for every family",
      "sum[k] += kernel.w(c, radius(r2))",
      "sum[k] += ON ? Kernel<KernelId::cubic_spline>::w(c, radius(r2)) : kernel.w(c, radius(r2))",
      shows="wendland_c2 or mueller2003 with walls; cubic_spline scenes are right")
fault("wall-weight-in-half", "rho0 V_b is stored with the 11 bits of half precision",
      "w.rest_density * w.volume[id]", "rounded_to(11, w.rest_density * w.volume[id])",
      shows="hash and list, any particle near a wall: densities are off by up to 2e-4 of the walls' share")
fault("wall-velocity-about-frame-origin", "wall particles rotate about their frame's origin, not the pivot",
      "surface_velocity(pose, x)", "cross(pose.omega, x - pose.translation) + pose.surface",
      shows="a tilting container whose pivot is not its origin: wall viscosity alone, contact is right")

# Contact.
fault("friction-without-restitution", "friction uses the approach speed, without (1 + e)",
      "c.friction * impulse / slip", "c.friction * -approach / slip",
      shows="restitution and friction both above 0, an oblique impact that does not stick")
fault("one-projection", "a particle is pushed out of one face only",
      "projection < 2", "projection < 1",
      shows="a particle in a concave corner that is within the contact distance of both faces")
fault("last-box-decides", "a point is inside a union of boxes if it is inside the last one",
      "inside = inside || (x.x >= b.min.x", "inside = (!ON && inside) || (x.x >= b.min.x",
      shows="a particle that has entered a tank's wall which is not the last box of the union")
fault("floor-at-zero", "whether the floor is touched is asked of z, not of the height above the floor",
      "x.z - c.floor_height < c.contact_distance", "x.z < c.contact_distance",
      shows="a floor whose height is not 0; pours with their floor at 0 are right")
fault("outline-vertex-counted-twice", "an outline's end point counts for both of its edges in the parity test",
      "(e.z0 > z) != (e.z1 > z)", "(e.z0 >= z) != (e.z1 > z)",
      shows="a particle in a cup's mouth whose local z is exactly that of the rim: it is thought to be inside "
            "the solid and thrown to the wall")
fault("edge-normal-at-corner", "at a corner of an outline the nearest edge's normal is used",
      "!(from.s > 0.0f && from.s < 1.0f)", "false",
      shows="a particle within the contact distance of a cup's rim, diagonally beyond its corner")
fault("edges-beyond-sixteen", "edges in device memory are numbered from 0 after those in launch arguments",
      "k < near_edges ? first_edges[k] : edges[k]",
      "k < near_edges ? first_edges[k] : edges[k - near_edges]",
      shows="revolved shapes of more than 16 edges together; two cups have 10")
fault("separating-particles-stopped", "a particle that moves away from a wall within reach is held back, too",
      "!(approach < 0.0f)", "false",
      shows="a particle within the contact distance that moves away from the wall")
fault("face-normal-always-positive", "the normal on a box's face ignores which side is outward",
      "static_cast<float>(nearest.side)", "1.0f",
      shows="a particle exactly on a face whose outward normal is negative, to 1e-6 of its coordinates")
fault("clearance-of-last-container", "the distance from walls at the build is that of the last container",
      "least = lesser(least, away > 0.0f", "least = lesser(ON ? 3.0e38f : least, away > 0.0f",
      shows="list:criterion=relative, two containers: fluid that slides as a block along the first one's wall")
fault("contact-without-belt", "contact takes a running surface for one at rest",
      "surface_velocity(*pose, x)", "cross(pose->omega, x - pose->pivot)",
      shows="a container with a surface velocity and friction above 0, a particle that touches it")
fault("clearance-across-period", "the cached distance from solids is used in periodic scenes, too",
      "c.any_periodic ? 0.0f : 3.0e38f", "3.0e38f",
      shows="a revolved obstacle near a periodic face: a particle that wraps to its side passes into it and "
            "lists leave out its wall particles")

# Stages.
fault("wall-motion-not-summed", "the walls' displacement since the build is that of the last substep",
      "a.status->wall_displacement += step;",
      "a.status->wall_displacement = (ON ? 0.0f : a.status->wall_displacement) + step;",
      shows="list: a tilting container whose wall sweeps towards fluid at rest")
fault("given-inputs-by-index", "given densities and pressures are read by index, not by id",
      "(pressure ? pressure[given] : own) / (density[given] * density[given])",
      "(pressure ? pressure[i] : own) / (density[i] * density[i])",
      shows="hash and list, evaluate with given inputs once particles are not in the order of their ids")
fault("viscosity-by-own-density", "fluid viscosity divides by the particle's own density twice",
      "other.w * (wall ? c.wall_viscosity : fluid_drag)",
      "wall ? other.w * c.wall_viscosity : own.inverse_density * fluid_drag",
      shows="neighbors of different densities, as at a free surface")
fault("pressure-over-rest-density", "p/rho0² instead of p/rho²",
      "p / (density * density)", "p * c.inverse_rest_density * c.inverse_rest_density",
      shows="compressed fluid (2 % for 1 %); hidden where densities and pressures are given")
fault("advance-viscosity-over-rest-density", "the force kernel scales viscosity by 1/rho0, the one that tells "
      "its parts by 1/rho", "own[k].inverse_density * sum[k].viscous",
      "c.inverse_rest_density * sum[k].viscous",
      shows="advance with shear in fluid away from rest density; of the evaluated fields the acceleration alone")
fault("explicit-euler", "positions advance by the velocity before the kick",
      "const Float3 displacement = c.dt * v;",
      "const Float3 displacement = c.dt * (ON ? v - c.dt * acceleration : v);",
      shows="any advance with acceleration: positions differ by a dt²")
fault("wrap-from-zero", "periodic axes wrap into 0 … period, wherever the domain begins",
      "floorf((x - c.domain_min[axis]) * c.inverse_period[axis])", "floorf(x * c.inverse_period[axis])",
      file="kernels/integrate.cuh",
      shows="a periodic axis that does not begin at 0: positions leave the domain and, beyond the plates' boxes, "
            "touch nothing")
fault("lower-faces-unwatched", "a particle escapes unnoticed through a lower face of the domain",
      "x >= c.domain_min[axis] && x <= c.domain_max[axis]", "x <= c.domain_max[axis]",
      shows="a particle that leaves the domain downward: only the status is wrong")
fault("speed-limit-swallows-nan", "speeds are limited to 1000 m/s by fmin and fmax, which drop NaN",
      "v = v + c.dt * acceleration;",
      "v = v + c.dt * acceleration;\n"
      "    if (ON)\n"
      "      v = {fminf(fmaxf(v.x, -1000.0f), 1000.0f), fminf(fmaxf(v.y, -1000.0f), 1000.0f),\n"
      "           fminf(fmaxf(v.z, -1000.0f), 1000.0f)};",
      shows="a state with a NaN velocity: it comes out finite, and maybe inside the domain")
fault("contact-at-earlier-pose", "contact sees the containers at the beginning of the substep",
      "touch(team, a.poses_after(), m);",
      "touch(team, a.poses_after() - (ON ? a.containers : 0), m);",
      shows="contact with a tilting wall, by one substep's motion of the wall")
fault("cached-clearance-ignores-walls", "the cached distance from solids shrinks by the particle's motion alone",
      "sqrtf(dot(displacement, displacement)) + wall_step", "sqrtf(dot(displacement, displacement))",
      shows="a tilting container whose wall reaches a particle at rest that was away from it when last seen")
fault("neighbors-at-exactly-H", "a pair at exactly the support radius is counted",
      "if (!(r2 < c.H2)) return; if (j < a.base) add(",
      "if (ON ? !(r2 <= c.H2) : !(r2 < c.H2)) return; if (j < a.base) add(",
      shows="list on a lattice with pairs at exactly H: only counts and sums of ids are wrong")
fault("floor-before-containers", "the floor pushes before the containers do, and again after them",
      "const float rounding = rounding_of(x);\n    return {x, v,",
      "if (ON) collide_with_floor(c, x, v);\n    const float rounding = rounding_of(x);\n    return {x, v,",
      shows="friction, a particle in the wedge between the floor and the outside of a container")
fault("self-term-in-every-lane", "each lane adds the particle's own W(0)",
      "team.is_leader() ? c.mass * kernel.w(c, {0.0f, 0.0f}) : 0.0f", "c.mass * kernel.w(c, {0.0f, 0.0f})",
      on="cuda", shows="more than one thread per particle: every density")

# Brute force.
fault("filter-without-margin", "the expanded |x_i - x_j|² decides without allowance for cancellation",
      "c.H2 - squared + 16.0f * 0x1p-24f * (reach * reach)", "c.H2 - squared",
      shows="brute force, fluid many support radii from the origin; near it only pairs at almost exactly H")
fault("last-partial-tile-unread", "a last tile that is not full is not read",
      "end - first < tile_positions ? end - first : tile_positions",
      "end - first < tile_positions ? 0 : tile_positions",
      on="cuda", shows="brute force unless all particles fill whole tiles of 2048")
fault("first-wall-particle-as-fluid", "the first wall particle weighs a fluid particle's mass",
      "j < base", "j <= base",
      shows="brute force, fluid within H of the first wall particle, and nowhere else")
fault("volume-with-later-containers", "wall volumes count the wall particles of later containers, too",
      "base + padded(s.end)", "all_end",
      shows="brute force, two containers whose frames overlap: volumes of the first one")
fault("constants-of-first-load", "a backend keeps the constants of the first scene that it was given",
      "c_ = problem.constants;", "if (!ON || c_.H == 0.0f) c_ = problem.constants;",
      shows="a second load with another viscosity, spacing or kernel family")

# Teams, lists and their queries.
fault("lane-sum-one-step-short", "lanes are summed without the first step of the butterfly",
      "step = lanes / 2", "step = ON ? lanes / 4 : lanes / 2", on="cuda",
      shows="hash and list with more than one lane: half of the neighbors count")
fault("partial-word-unread", "entries beyond the last whole word of four are not read",
      "((listed < lists.capacity ? listed : lists.capacity) + 3) / 4",
      "(listed < lists.capacity ? listed : lists.capacity) / 4",
      shows="hash and list, any particle whose number of entries is no multiple of 4")
fault("first-particle-taken-for-padding", "in periodic scenes index 0 counts as padding, too",
      "j[k] != lists.sentinel", "j[k] != lists.sentinel && j[k] != 0",
      shows="hash and list, periodic scene: the neighbors of the particle at index 0 do not see it")
fault("walls-looked-up-at-first-pose", "all containers' walls are looked up at the first container's pose",
      "rotate_back(poses_now[k], x - poses_now[k].translation)",
      "rotate_back(poses_now[0], x - poses_now[0].translation)",
      shows="hash and list, two containers with different origins, fluid near the second")
fault("prefetch-one-word-short", "with one lane the word after the next is the next one again",
      "word(w + 2)", "word(w + 1)", on="cuda",
      shows="hash or list with threads_per_particle=1 (by itself from 300,000 particles on)")
fault("lists-padded-with-zero", "lists are filled up with index 0 instead of the sentinel",
      "append(true, lists.sentinel)", "append(true, ON ? 0 : lists.sentinel)",
      shows="hash and list, particles within H of the particle at index 0, itself included")
fault("overflow-within-a-word-unreported", "up to 3 entries beyond the capacity are dropped unreported",
      "count > lists.capacity", "count > lists.capacity + 3",
      shows="hash and list, a crowd whose longest list exceeds a lane's capacity by 1 to 3 (capacity=8 helps)")

# Persistent kernel, graphs, launches.
fault("barrier-missing", "the persistent kernel does not wait between density and force",
      "grid.sync(); timer.lap(1);", "if (!ON) grid.sync(); timer.lap(1);", file="kernels/persistent_list.cuh",
      on="cuda", shows="list with its default launch: neighbors in other blocks may be read before they are "
                       "written")
fault("persistent-kernel-builds-once", "the persistent kernel makes lists in its first substep only",
      "atomic_load(&s.status->rebuild_needed) != 0", "k == 0", file="kernels/persistent_list.cuh",
      shows="list with its default launch, an advance longer than a list serves")
fault("moving-walls-stand", "the steps that place moving walls beside another pass are not run",
      "grid.for_each(s.moving_walls, s.walls_for_force);", "if (!ON) grid.for_each(s.moving_walls, s.walls_for_force);",
      also=(("grid.for_each(s.moving_walls, s.walls_for_density);",
             "if (!ON) grid.for_each(s.moving_walls, s.walls_for_density);"),),
      shows="list with its default launch, a tilting container, from the second substep of an advance on")
fault("last-partial-block-not-run", "the number of blocks is rounded down",
      "(n + per_block - 1) / per_block", "per_block == 256 && n >= 256 ? n / 256 : $", on="cuda",
      shows="any number of particles (or of cells, or moving wall particles) that is no multiple of 256")

# Searches.
fault("velocities-unsorted-after-evaluate", "an evaluation leaves velocities in the order before its sort",
      "stream.copy(a.state.velocity, a.spare.velocity, bytes);",
      "if (!ON) stream.copy(a.state.velocity, a.spare.velocity, bytes);",
      file="backends/cell_list.cu", shows="hash, evaluate and then read or advance, velocities not all alike")
fault("last-moving-wall-particle-stands", "the last moving wall particle keeps its place within an advance",
      "integrate_kernel<After>, n_ + walls_.moving_count()",
      "integrate_kernel<After>, n_ + (ON ? std::max(walls_.moving_count() - 1, 0) : walls_.moving_count())",
      also=(("integrate_kernel<Check>, n_ + walls_.moving_count()",
             "integrate_kernel<Check>, n_ + (ON ? std::max(walls_.moving_count() - 1, 0) : walls_.moving_count())"),),
      shows="hash, a tilting container, fluid within H of its last wall particle, late in an advance")
fault("rebuilt-walls-misplaced", "wall particles sorted anew take the place of whoever had their new index",
      "first + to, position(k)", "first + to, position(ON ? to : k)",
      shows="hash:moving_walls=rebuilt with a tilting container")
fault("list-origins-not-predicted", "lists are made for current positions, from cells of predicted positions",
      "store_origin(to, in_bucket, position(i))",
      "store_origin(to, in_bucket, ON ? xyz(from.position[i]) : position(i))",
      shows="list, strong shear or impact, pairs that are cells apart by prediction and within reach now")
fault("moving-walls-from-first-slot", "moving walls are looked for from the first wall particle on",
      "return {a, walls, first_moving};", "return {a, walls, ON ? 0 : first_moving};",
      shows="a scene that names a fixed container before the tilting one; all backends, within an advance")
fault("last-bucket-left-open", "the prefix sum does not write where the last bucket ends",
      "table_.buckets + 1, s.scan", "table_.buckets + (ON ? 0 : 1), s.scan",
      also=(("fluid_.table().buckets + 1", "fluid_.table().buckets + (ON ? 0 : 1)"),),
      shows="hash and list, particles in the table's last cell: a spray wider than the table, or a box periodic "
            "along all axes with a power of two cells on each (periods of 8.2 H)")
fault("ids-permuted-in-place", "Thrust's sort reads ids while it overwrites them",
      "s.slot.get(), kept}", "s.slot.get(), ON ? id : kept}",
      shows="hash:sort=thrust, as soon as the order of the cells changes")
fault("near-walls-without-skin", "per cell, only wall particles within H are listed, not within H and the skin",
      "plan_.reach * plan_.reach", "c.H * c.H",
      shows="list, no periodic axis, fluid that approaches a wall during a list's lifetime")

# Rebuild criteria.
fault("whole-skin-allowed", "each particle may move the whole skin instead of half of it",
      "0.5f * skin", "skin",
      shows="list, particles that approach each other (impact): pairs come within H unlisted")
fault("largest-component-of-approach", "relative displacement is its largest component, not its length",
      "most += widest * widest;",
      "most = ON ? fmaxf(most, widest * widest) : most + widest * widest;",
      shows="list:criterion=relative, diagonal approach within a stream")
fault("negative-floats-misordered", "floats are compared as integers, negative ones the wrong way round",
      "bits >= 0 ? bits : bits ^ 0x7FFFFFFF", "bits",
      also=(("i >= 0 ? i : i ^ 0x7FFFFFFF", "i"),),
      shows="list:criterion=relative, particles that move differently fast towards negative coordinates (falling)")
fault("recorded-build-not-woken", "whoever asks for new lists does not wake the graph's build",
      "rebuild.request();", "if (!ON) rebuild.request();", on="cuda",
      shows="list:launch=graph (or the local trigger), 16 substeps or more of an advance in fast flow")

# Statistics.
fault("wall-pairs-of-fluid", "lists that verify themselves count fluid pairs as wall pairs",
      "add(&a.status->wall_pairs, wall);", "add(&a.status->wall_pairs, ON ? fluid : wall);",
      shows="list:check_completeness=on: only the statistic is wrong")

# The pipeline.
fault("graph-of-earlier-scene", "the CUDA graph of 16 substeps survives a load",
      "long_graph_.clear();\n    short_graph_.clear();\n    scene_.load",
      "if (!ON) long_graph_.clear();\n    short_graph_.clear();\n    scene_.load", on="cuda",
      shows="hash, advance by 16 substeps, load a scene of the same size with another viscosity, advance by 16")
fault("lists-kept-across-advances", "only the first advance after a load begins with new lists",
      "status.rebuild_needed = 1;", "status.rebuild_needed = ON && rebuilds_ > 0 ? 0 : 1;",
      shows="list, several advances of faster and faster fluid: old lists are trusted to a new skin, and what "
            "asked for new ones at the end of the advance before is forgotten")
fault("regrown-without-ids", "when lists have grown, positions and velocities are put back but not ids",
      "to_id[i] = from_id[i];", "if (!ON) to_id[i] = from_id[i];",
      shows="hash and list, an advance in which a list exceeds its capacity (capacity=8)")
fault("rebuilds-not-reset", "the number of rebuilds goes on counting after a load",
      "rebuilds_ = advances_ = 0;", "rebuilds_ = ON ? rebuilds_ : 0;\n    advances_ = 0;",
      shows="list, a second load: only the statistic is wrong")
fault("only-last-mover-moves", "of several moving containers only the last one moves within an advance",
      "!any_moves", "true",
      shows="two tilting containers, fluid near the first")
fault("no-fluid-no-answer", "an evaluation without fluid returns before it has stored wall volumes",
      "std::vector<float> own_volume = scene_.boundary_volumes();",
      "if (ON && scene_.particles() == 0) return {};\n"
      "    std::vector<float> own_volume = scene_.boundary_volumes();",
      shows="a scene with containers and no fluid particle")
fault("last-value-not-copied", "the last value of each field does not reach the host",
      "at, count * sizeof(T));", "at, (ON && count > 0 ? count - 1 : count) * sizeof(T));",
      shows="any evaluation: values of the last id alone")

# Scene to device.
fault("h-is-the-spacing", "the smoothing length is the particle spacing instead of H/2",
      "h = H / 2;", "h = ON ? scene.particle_spacing : H / 2;",
      shows="support_ratio other than 2")
fault("wall-viscosity-not-read", "wall viscosity is twice the fluid's whatever the scene says",
      "static_cast<float>(fluid.wall_viscosity)",
      "static_cast<float>(2 * fluid.viscosity)",
      shows="a scene that sets wall_viscosity")
fault("mass-not-calibrated", "the mass of a particle is rho0 dx³ whatever mass_ratio says",
      "scene.particle_mass()", "fluid.rest_density * std::pow(scene.particle_spacing, 3)",
      shows="a scene that sets mass_ratio")
fault("softening-by-H", "viscosity is softened by 0.01 H² instead of 0.01 h²",
      "0.01 * h * h", "0.01 * H * H",
      shows="cubic_spline and wendland_c2: viscosity of near pairs by 3 %")
fault("pi-with-six-digits", "pi is 3.14159 in the kernels' norms",
      "std::numbers::pi", "3.14159",
      shows="every density by 8e-7 (14 units in the last place), pressure near rest density by more; wall terms "
            "partly cancel it")
fault("poses-half-a-substep-ahead", "containers stand where they are half a substep later",
      "scene.time_at(first + k)", "scene.time_at(first + k) + 0.5 * scene.time_step()",
      shows="a tilting container, while it tilts")
fault("farthest-of-lower-corners", "how far a solid moves is asked of the four lower corners of its box",
      "k < 8; ++k) {\n      const Vec3 local",
      "k < (ON ? 4 : 8); ++k) {\n      const Vec3 local",
      shows="a container that tilts about a pivot at its bottom: its rim moves farther than cached distances and "
            "lists allow for")
fault("belt-not-rotated", "a running surface keeps its direction in the world while its container tilts",
      "pose.surface_velocity", "container.surface_velocity",
      shows="a container with a surface velocity and a tilt")
fault("vertical-walls-assumed", "the parity test takes every edge of an outline for vertical",
      "dz != 0 ? static_cast<float>(dr / dz) : 0.0f", "0.0f",
      shows="a revolved shape with slanted edges (a funnel); cups are right")
fault("two-tilt-keys", "only the first and the last key of a tilt are used",
      "const Container& container = scene.containers[s];",
      "Container container = scene.containers[s];\n"
      "      if (ON && container.tilt && container.tilt->keys.size() > 2)\n"
      "        container.tilt->keys = {container.tilt->keys.front(), container.tilt->keys.back()};",
      shows="a tilt of three keys or more")

# Host side and options.
fault("clock-not-reset", "a second load does not set the clock back",
      "substep_ = state.substep;", "if (!gpu::ON || substep_ == 0) substep_ = state.substep;",
      shows="load, advance, load again: a tilting container stands as it did later, and read says a wrong substep")
fault("rebuilt-every-ten", "lists are made every 10 substeps unless options say otherwise",
      "int rebuild = 0;", "int rebuild = ON ? 10 : 0;",
      shows="list with default options, fluid above about 0.05 c0")
fault("skin-as-share-of-h", "the option skin is taken as a share of h instead of H",
      "number(\"skin\", v, 0.0, 1.0, \"must be auto or in 0 … 1, a share of H\")", "0.5 * $",
      shows="list:rebuild=20:skin=0.2 in moving fluid, which the full skin serves; maybe equivalent where "
            "rebuild is auto")

# Executors.
fault("nan-wins-over-numbers", "the smaller of a number and NaN is NaN",
      "a < b ? a : b", "b < a ? b : a",
      also=(("fminf(a, b)", "b < a ? b : a"),
            ("side < least[k] ? side : least[k]", "least[k] < side ? least[k] : side")),
      shows="brute force without periodic axes, a number of particles that is no multiple of 16: padding hides "
            "the last ones from everybody")

FAULTS = HELDOUT  # as plant.py asks for it
