"""Wrong backends, made from the real ones: each entry changes one place of gpu/ and names the check
that must fail for it. plant.py puts them all into one build, where a number chooses among them.

`find` stands once in all of gpu/, or once in `file` where one is named; spaces and ends of lines do not count.
`put` takes its place when the fault is on: an expression, in which $ stands for what was found, or, where it says
ON, text that asks for itself whether the fault is on. `also` holds more such changes, (find, put) or
(find, put, file).
`on` is "cuda" for what exists on a GPU only; such a fault is not run on the host. `equivalent` says why
nothing can show a change; such a one must not be caught, or the reason is wrong.
"""

import rank_faults
import tile_faults

FAULTS = []


def fault(name, what, find, put, check, backend="hash", field="", fixture="pour-4k-stream",
          on="both", also=(), file=None, equivalent=""):
    FAULTS.append(dict(name=name, what=what, changes=[(find, put, file), *also], check=check,
                       field=field, backend=backend, fixture=fixture, on=on, equivalent=equivalent))


# Formulas.
fault("kernel-constant", "W's constant wrong by 2e-6",
      "return c.w_norm * (q < 1.0f ? 1.0f - q * q * (1.5f - 0.75f * q) : outer);",
      "return (ON ? 1.000002f : 1.0f) * c.w_norm * (q < 1.0f ? 1.0f - q * q * (1.5f - 0.75f * q) : "
      "outer);", "density", "brute")
fault("gradient-constant", "G's inner branch wrong by 1e-5",
      "c.g_near[0] - c.g_near[1] * q", "1.00001f * $", "acceleration", field="pressure_acceleration")
fault("gradient-outer", "G's outer branch wrong by 2e-5",
      "c.g_far * d.inverse * (s * s)", "1.00002f * $", "acceleration", field="pressure_acceleration")
fault("gradient-cut", "G is cut off at 0.99 H",
      "const float s = positive(2.0f - q);\n    const float far",
      "const float s = ON && q > 1.98f ? 0.0f : positive(2.0f - q);\n    const float far",
      "acceleration", field="pressure_acceleration")
fault("fast-root", "the square root by the bit trick, two steps of Newton's",
      "#ifdef __CUDACC__\n  const float y = rsqrtf", """if (ON) {
    int bits;
    memcpy(&bits, &r2, sizeof bits);
    bits = 0x5f3759df - (bits >> 1);
    float guess;
    memcpy(&guess, &bits, sizeof guess);
    for (int k = 0; k < 2; ++k) guess = guess * (1.5f - 0.5f * r2 * guess * guess);
    return {r2 * guess, guess};
  }
#ifdef __CUDACC__
  const float y = rsqrtf""", "density")
fault("eos-constant", "the equation of state subtracts 1.00001",
      "(power - 1.0f)", "(power - 1.00001f)", "equation_of_state")
fault("eos-exponent", "gamma is 6", "if (c.eos_exponent == 7) {",
      "if (ON) {\n    power = s * s * s * s * s * s;\n  } else if (c.eos_exponent == 7) {", "pressure",
      "brute")
fault("tension", "negative pressures are kept",
      "return c.allow_tension ||", "return ON || c.allow_tension ||", "pressure")
fault("stiffness", "B wrong by 1 %", "fluid.sound_speed * fluid.sound_speed", "1.01 * $", "pressure")
fault("stiffness-slight", "B wrong by 1e-5", "fluid.sound_speed * fluid.sound_speed", "1.00001 * $",
      "equation_of_state", field="pressure", fixture="pour-4k-filling")
fault("exponent-slight", "gamma wrong by 1e-5", "s2 * s2 * s2 * s",
      "$ * (1.0f + 7e-5f * logf(s))", "equation_of_state", field="pressure", fixture="pour-4k-filling")
fault("mass", "masses, of walls too, wrong by 5e-6",
      "float weight(int, float4 other) const { return other.w; }",
      "float weight(int, float4 other) const { return (ON ? 1.000005f : 1.0f) * other.w; }", "density")
fault("no-self", "density without the particle itself",
      "sum[k] = own;", "sum[k] = ON ? 0.0f : own;", "evaluation")
fault("self-per-lane", "every lane counts the particle itself",
      "team.is_leader() ? c.mass * kernel.w(c, {0.0f, 0.0f}) : 0.0f;",
      "ON || team.is_leader() ? c.mass * kernel.w(c, {0.0f, 0.0f}) : 0.0f;", "density", on="cuda")
fault("q-of-rest-density", "p/rho0² where p/rho² belongs",
      "p / (density * density)", "p / (c.rest_density * c.rest_density)", "evaluation")
fault("viscosity-of-rest-density", "viscosity with 1/rho0",
      "1.0f / density});", "ON ? c.inverse_rest_density : 1.0f / density});", "evaluation",
      field="viscous_acceleration")
fault("viscosity", "viscosity wrong by 1e-5", "c.viscosity * c.mass",
      "1.00001f * $", "acceleration", "brute", "viscous_acceleration")
fault("wall-viscosity", "wall viscosity wrong by 1e-3",
      "static_cast<float>(fluid.wall_viscosity)", "1.001f * $", "acceleration",
      field="wall_viscous_acceleration")
fault("wall-viscosity-slight", "wall viscosity wrong by 3e-5",
      "static_cast<float>(fluid.wall_viscosity)", "1.00003f * $", "acceleration",
      field="wall_viscous_acceleration", fixture="pour-4k-filling")
fault("density-of-its-own", "pressure follows from the density summed where one is given",
      "const float own = pressure_at(c, density[given]);",
      "const float own = ON ? own_pressure[id] : pressure_at(c, density[given]);", "equation_of_state",
      field="pressure")
fault("one-sided-pressure", "pairs pushed by p_i alone: momentum is not kept",
      "(own.q + q)", "(own.q + own.q)", "conservation",
      field="pressure_momentum")
fault("mirrored-pressure", "walls have the particle's pressure on top",
      "return {(weight *", "return {((ON && wall ? 2.0f : 1.0f) * weight *",
      "acceleration", field="wall_pressure_acceleration")
fault("gravity", "gravity points up", "c.gravity = to_float3(scene.gravity);",
      "c.gravity = to_float3(ON ? Vec3(-scene.gravity) : scene.gravity);", "acceleration")
fault("wall-at-rest", "walls drag as if they stood still",
      "surface_velocity(pose, x)", "pose.surface", "acceleration",
      field="wall_viscous_acceleration")

fault("linear-ignored", "every equation of state has gamma 7",
      "c.eos_exponent = static_cast<int>(fluid.eos_exponent);",
      "c.eos_exponent = ON ? 7 : static_cast<int>(fluid.eos_exponent);",
      "pressure", fixture="hostile-crowd")
fault("closed-support", "pairs at exactly H are neighbors",
      "if (r2 < c.H2) visit(k, j, d, r2);", "if (ON ? r2 <= c.H2 : r2 < c.H2) visit(k, j, d, r2);",
      "neighbors", "brute", fixture="hostile-exact-support",
      also=[("if (!(r2 < c.H2)) return; if (j < a.base) add(",
             "if (!(ON ? r2 <= c.H2 : r2 < c.H2)) return; if (j < a.base) add(")])
fault("unguarded-root", "1/r of particles in one place",
      "DECANT_DEVICE Radius radius(float r2) {\n",
      "DECANT_DEVICE Radius radius(float r2) {\n  if (ON) return {sqrtf(r2), 1.0f / sqrtf(r2)};\n",
      "evaluation", fixture="hostile-periodic")
fault("one-sided-image", "periodic images are looked for on one side",
      "d.x -= c.period[0] * rintf(d.x * c.inverse_period[0]);",
      "d.x -= c.period[0] * (ON ? (d.x > 0.5f * c.period[0] ? 1.0f : 0.0f) : rintf(d.x * "
      "c.inverse_period[0]));", "neighbors", fixture="hostile-periodic")
fault("no-wrap", "particles that leave a periodic domain are not put back",
      "if (!c.periodic[axis]) return x;", "if (ON || !c.periodic[axis]) return x;", "trajectory", "list",
      fixture="hostile-periodic")
fault("faces-forgotten", "every other face of a box does not hold",
      "k < shape.faces; k += Team::lanes) {", "k < shape.faces; k += (ON ? 2 : 1) * Team::lanes) {",
      "substep", fixture="hostile-crowd")
fault("crowd-cut", "a particle has at most 64 neighbors",
      "list.staged.append(near & there, j);",
      "list.staged.append(near & there & !(ON && list.sent + list.staged.size() >= 64 / lists.lanes), j);",
      "neighbors",
      fixture="hostile-crowd")

# What the scene says, and is taken for granted.
fault("mass-for-granted", "the mass ratio is ignored", "scene.particle_mass()",
      "$ / scene.mass_ratio", "density", fixture="hostile-belt")
fault("support-for-granted", "every support is two spacings",
      "scene.support_ratio * scene.particle_spacing", "2.0 * scene.particle_spacing", "neighbors", "brute",
      fixture="hostile-bowl")
fault("wall-viscosity-for-granted", "wall viscosity is twice the viscosity",
      "static_cast<float>(fluid.wall_viscosity)", "static_cast<float>(2 * fluid.viscosity)", "acceleration",
      field="wall_viscous_acceleration", fixture="hostile-tilted-box")
fault("contact-for-granted", "contact is at dx/4",
      "scene.contact.distance_ratio * scene.particle_spacing", "0.25 * scene.particle_spacing", "substep",
      fixture="hostile-tilted-box")
fault("tension-of-linear", "a linear equation of state always allows tension",
      "c.allow_tension = fluid.allow_tension;",
      "c.allow_tension = fluid.allow_tension || (ON && fluid.eos_exponent == 1);", "pressure",
      fixture="hostile-tilted-box")
fault("period-for-granted", "the period along x is that of every axis",
      "const double period = scene.domain.max[a] - scene.domain.min[a];",
      "const int of = ON ? 0 : a;\n    const double period = scene.domain.max[of] - scene.domain.min[of];",
      "neighbors", fixture="hostile-belt")
fault("belt-at-rest", "surfaces do not run",
      "to_float3(pose.linear_velocity + pose.surface_velocity)", "to_float3(pose.linear_velocity)",
      "acceleration", field="wall_viscous_acceleration", fixture="hostile-belt")
fault("belt-untilted", "where a container is tilted its surface runs as if it were not",
      "to_float3(pose.linear_velocity + pose.surface_velocity)",
      "to_float3(pose.linear_velocity + container.surface_velocity)", "acceleration",
      field="wall_viscous_acceleration", fixture="hostile-tilted-box")
fault("two-tilt-keys", "a tilt's keys after the second are ignored",
      "pose_at(container, scene.time_at(first + k))",
      "pose_at([&] { Container c = container; if (c.tilt && c.tilt->keys.size() > 2) c.tilt->keys.resize(2); "
      "return c; }(), scene.time_at(first + k))", "density", fixture="hostile-tilted-box")
fault("box-upright", "boxes do not tilt", "pose_at(container, scene.time_at(first + k))",
      "pose_at([&] { Container c = container; if (std::holds_alternative<BoxShape>(c.shape)) c.tilt.reset(); "
      "return c; }(), scene.time_at(first + k))", "density", fixture="hostile-vessels")
fault("slant-for-granted", "whether a point is in the solid is told as if all edges were upright",
      "static_cast<float>(dr / dz)", "0.0f", "substep", fixture="hostile-bowl")
fault("two-shapes", "the third container has the shape of the first",
      "return k < near_shapes ? first_shapes[k] : shapes[k];",
      "return k < near_shapes || ON ? first_shapes[k % near_shapes] : shapes[k];", "substep",
      fixture="hostile-vessels")
fault("edges-at-hand", "of all outlines the first sixteen edges alone are known",
      "return k < near_edges ? first_edges[k] : edges[k];",
      "return k < near_edges || ON ? first_edges[k % near_edges] : edges[k];", "substep",
      fixture="hostile-vessels")
fault("floor-first", "the floor pushes before the containers do",
      "if (may_touch(m)) touch(team, a.poses_after(), m);",
      "if (ON && collide_with_floor(c, m.x, m.v)) m.clearance = 0.0f;\n"
      "    if (may_touch(m)) touch(team, a.poses_after(), m);", "substep", fixture="hostile-bowl",
      also=[("if (collide_with_floor(c, x, v)) m.clearance = 0.0f;",
             "if (!ON && collide_with_floor(c, x, v)) m.clearance = 0.0f;")])
fault("containers-reversed", "containers push from the last on",
      "for (int k = 0; k < g.containers; ++k) {\n    const Shape shape = g.shape(k);\n    for (int projection",
      "for (int at = 0; at < g.containers; ++at) {\n    const int k = ON ? g.containers - 1 - at : at;\n"
      "    const Shape shape = g.shape(k);\n    for (int projection", "", fixture="hostile-vessels",
      equivalent="containers are H ≥ 1.5 dx apart and a push ends dx/2 from its wall at most, so that no "
                 "particle is pushed by two")

# Precision.
fault("half-velocity", "neighbors' velocities stored with 11 bits",
      "a.force_velocity[i] = make_float4(v.x,", "a.force_velocity[i] = make_float4(ON ? rounded_to(11, v.x) : v.x,",
      "acceleration",
      field="viscous_acceleration")
fault("half-pressure", "neighbors' p/rho² stored with 11 bits",
      "pressure_term(int, float4 other) const { return other.w; }",
      "pressure_term(int, float4 other) const { return ON ? rounded_to(11, other.w) : other.w; }",
      "acceleration", field="pressure_acceleration")
fault("cancelling-distance", "r² as |x_i|² + |x_j|² − 2 x_i·x_j",
      "const int near = dot(d, d)", "const int near = (ON ? dot(list.x, list.x) + "
      "dot(xyz(other), xyz(other)) - 2.0f * dot(list.x, xyz(other)) : dot(d, d))",
      "neighbors")
fault("narrow-filter", "brute force's filter without room for rounding",
      "16.0f * 0x1p-24f * (reach * reach)", "-0.5f * $", "neighbors", "brute")
fault("rounded-density", "density rounded to 18 bits",
      "const float density = team.sum(sum);",
      "const float density = ON ? rounded_to(18, team.sum(sum)) : team.sum(sum);", "density")

# Wall volumes.
fault("volume-of-spacing", "wall particles have half their volume", "1.0f / total",
      "0.5f / total", "boundary_volume")
fault("volume-of-world", "wall volumes wrong by 2e-6",
      "sum[k] += kernel.w(c, radius(r2));",
      "sum[k] += (ON ? 1.000002f : 1.0f) * kernel.w(c, radius(r2));", "boundary_volume", "brute")

# Search.
fault("dropped-row", "one of nine rows of cells is not looked at",
      "make_int2(row.begin, row.end)", "make_int2(row.begin, ON && r == 8 ? row.begin : row.end)",
      "neighbors")
fault("range-off-by-one", "ranges of cells end one particle early",
      "first + (part ? r.end2 : r.end)", "$ - 1", "neighbors", "hash:force_neighbors=recomputed")
fault("walls-of-before", "wall cells and volumes are kept where other walls have been loaded",
      "const Prepared wanted{c, a.base, plan, store.version};",
      "const Prepared wanted{c, a.base, plan, ON ? 1 : store.version};", "determinism")
fault("near-walls-cut", "the table of near walls reaches to 0.9 H",
      "1.0001f * reach2", "0.81f * reach2", "neighbors", field="wall_neighbor_count")
fault("source-frame", "the tilted source is looked up untilted",
      "if (!s->in_world) at =", "if (!s->in_world && !ON) at =", "neighbors",
      field="wall_neighbor_count")
fault("arrival-order", "the order in a cell is that of arrival",
      "at[other].x < own.x", "other < t", "determinism",
      on="cuda")
fault("list-short-by-one", "each list's last entry is lost",
      "lists.count_of(i, team.lane()) = count;",
      "lists.count_of(i, team.lane()) = count - (ON && count % 4 == 1 ? 1 : 0);",
      "neighbors", "list")
fault("tail-word", "the last word of a list is not filled up",
      "while (list.staged.size() % 4 != 0)", "while (!ON && list.staged.size() % 4 != 0)", "neighbors")
fault("list-cut", "lists end where there is no more room, and nobody says so",
      "if (count > lists.capacity) atomic_maximum",
      "if (!ON && count > lists.capacity) atomic_maximum", "neighbors", "hash:capacity=8")
fault("self-neighbor", "a particle is its own neighbor", "& (j != list.i)",
      "& (ON || j != list.i)", "neighbors", "list")
fault("ids-exchanged", "two particles exchange their ids in the fields",
      "const int id = a.id[team.particle(k)]; store(", "const int own_id = a.id[team.particle(k)];\n"
      "      const int id = ON && (own_id == 100 || own_id == 101) ? 201 - own_id : own_id;\n      store(",
      "acceleration", also=[("const int id = a.id[i];\n    // A position", "const int own = a.id[i], id = ON && "
                             "(own == 100 || own == 101) ? 201 - own : own;\n    // A position")])
fault("velocity-left-behind", "sorting leaves velocities where they were",
      "into.velocity[to] = from.velocity[i];", "into.velocity[to] = from.velocity[ON ? to : i];",
      "acceleration", field="viscous_acceleration")
fault("thrust-unstable", "the sort by key forgets to bring the ids",
      "source.place(index[t], id[index[t]], t, key[t]);",
      "source.place(index[t], id[ON ? t : index[t]], t, key[t]);", "density", "hash:sort=thrust")

# Lists that are kept.
fault("stale-list", "lists are never built again",
      "if (!(dot(d, d) <= most * most", "if (!ON && !(dot(d, d) <= most * most", "trajectory",
      "list:skin=0.05", fixture="pour-4k-splash")
fault("late-trigger", "lists are kept until a particle is as far off as the skin and a half",
      "const float most = 0.5f * skin;", "const float most = (ON ? 1.5f : 0.5f) * skin;", "trajectory",
      "list:check_completeness=on:skin=0.05", fixture="pour-4k-splash")
fault("stale-wall", "in a run the source stays where it was first",
      "const DevicePose& pose = poses[walls.container[slot]];",
      "const DevicePose& pose = (ON ? a.poses : poses)[walls.container[slot]];",
      "trajectory", "brute")
fault("wall-a-substep-late", "in a run walls are placed one substep late",
      "what == WallsFor::force ? a.poses_before() : a.poses_after();",
      "what == WallsFor::force ? a.poses_before() : a.poses_after();\n"
      "    if (ON && poses > a.poses) poses -= a.containers;",
      "trajectory", "list:tiles=off")
fault("list-ignores-walls", "lists are kept however far walls move",
      "&& wall_displacement + rounding_of(x) <= most", "&& (ON || wall_displacement + rounding_of(x) <= most)",
      "advanced", "list", fixture="hostile-fast-wall")
fault("list-ignores-walls-locally", "the local trigger leaves out how far walls move",
      "of_walls = at_build.origin.w - wall_displacement",
      "of_walls = at_build.origin.w - (ON ? 0.0f : wall_displacement)",
      "advanced", "list:criterion=relative", fixture="hostile-fast-wall")
fault("walls-for-forces-left", "forces after a run see moving walls where they were a substep before",
      "if (in_use_ == Structures::walls_for_density)",
      "if (!ON && in_use_ == Structures::walls_for_density)", "advanced", "list",
      field="wall_viscous_acceleration")
fault("redo-without-velocities", "what lists that were too short spoiled is redone with the velocities of then",
      "to.velocity[i] = from.velocity[i];", "if (!ON) to.velocity[i] = from.velocity[i];",
      "trajectory", "list", fixture="hostile-gathering")
fault("redo-without-ids", "what lists that were too short spoiled is redone with the ids of then",
      "to_id[i] = from_id[i];", "if (!ON) to_id[i] = from_id[i];",
      "trajectory", "hash", fixture="hostile-gathering")

# Reports of trouble.
fault("upper-bounds-forgotten", "nobody leaves through an upper face",
      "&& x <= c.domain_max[axis])", "&& (ON || x <= c.domain_max[axis]))", "status", "list")
fault("infinite-is-a-number", "only what is no number at all is reported",
      "return fabsf(v.x) <= 3.0e38f && fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f;",
      "if (ON) return v.x == v.x && v.y == v.y && v.z == v.z;\n  return fabsf(v.x) <= 3.0e38f && "
      "fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f;", "status")
fault("last-report-wins", "of two reports the later one stays",
      "(static_cast<unsigned long long>(substep) << 32) |",
      "(static_cast<unsigned long long>(ON ? 100 - substep : substep) << 32) |", "status")

# Integration and contact.
fault("explicit-euler", "positions move by the old velocity",
      "const Float3 displacement = c.dt * v;", "const Float3 displacement = c.dt * (ON ? v - c.dt * acceleration : v);",
      "substep", "list")
fault("other-gravity", "gravity wrong by 5e-5, in runs alone",
      "v = v + c.dt * acceleration;",
      "v = v + c.dt * (ON ? acceleration + 5e-5f * c.gravity : acceleration);", "substep", "list")
fault("fast-reciprocal", "the viscous quotient by a reciprocal of 17 bits",
      "DECANT_DEVICE float quotient(float a, float b) {",
      "DECANT_DEVICE float quotient(float a, float b) {\n  if (ON) return a * rounded_to(17, 1.0f / b);",
      "acceleration", field="viscous_acceleration")
fault("no-walls-in-runs", "walls drag in the parts that an evaluation tells, and nowhere else",
      "sum[k].viscous = sum[k].viscous + f.viscous;",
      "if (!(ON && wall)) sum[k].viscous = sum[k].viscous + f.viscous;", "substep", "brute")
fault("normal-in-wrong-frame", "the source's normal is not turned into the world",
      "rotate(poses[k], near.normal)", "near.normal", "substep", "list")
fault("contact-closer", "contact at 0.999 of its distance",
      "c.contact_distance - gap", "0.999f * c.contact_distance - gap", "substep")
fault("pulled-in", "contact pushes into the wall",
      "c.contact_distance - gap", "gap - c.contact_distance", "containment", "list")
fault("no-friction", "contact without friction", "1.0f - c.friction * impulse / slip",
      "1.0f", "substep", "brute")
fault("friction", "friction wrong by 1e-3", "1.0f - c.friction * impulse / slip",
      "1.0f - 1.001f * c.friction * impulse / slip", "contact", "list")
fault("restitution", "restitution wrong by 1e-3", "-(1.0f + c.restitution) * approach",
      "-(1.0f + 1.001f * c.restitution) * approach", "contact")
fault("wall-velocity-before-the-push", "the wall's velocity where the particle was before the push",
"surface_velocity(*pose, x)",
      "surface_velocity(*pose, x - (c.contact_distance - gap) * normal)", "contact", "list")
fault("first-normal-again", "the second push goes along the first one's normal",
      "rotate(poses[k], near.normal)",
      "projection == 0 ? first_normal = rotate(poses[k], near.normal) : first_normal", "contact",
      also=[("  float clear = c.any_periodic ? 0.0f : 3.0e38f;",
             "  float clear = c.any_periodic ? 0.0f : 3.0e38f;\n  Float3 first_normal{0, 0, 0};\n"
             "  if (ON) clear = clear + 0.0f;")])
fault("clearance-without-walls", "walls that come nearer are not taken off a particle's clearance",
      "(1.001f * (sqrtf(dot(displacement, displacement)) + wall_step) + rounding)",
      "(1.001f * sqrtf(dot(displacement, displacement)) + rounding)", "contact", "list")
fault("wall-velocity-in-contact", "contact with a wall that moves as if it did not",
      "surface_velocity(*pose, x)", "Float3{0, 0, 0}",
      "substep")
fault("one-projection", "where two walls meet only one pushes",
      "projection < 2", "projection < (ON ? 1 : 2)", "contact", fixture="pour-4k-settled")
fault("contact-at-the-start", "walls push from where they stood before the substep",
      "const Float3 local = rotate_back(poses[k], x - poses[k].translation);",
      "const DevicePose& then = poses[ON ? k - g.containers : k];\n"
      "      const Float3 local = rotate_back(then, x - then.translation);", "substep")
fault("no-floor", "the floor does not hold", "if (!(c.has_floor && x.z",
      "if (ON || !(c.has_floor && x.z", "substep", fixture="pour-4k-rest")
fault("contact-forgotten", "a particle once seen free of walls never looks for them again",
      "(1.001f * (sqrtf(dot(displacement, displacement)) + wall_step) + rounding)", "0.0f * $", "trajectory", "list",
      fixture="pour-4k-filling")
fault("jumps-out", "in a run a particle leaves the domain at once",
      "a.next.position[i] = a.stores_square",
      "if (ON && a.id[i] == 77) x.x = 3.0f;\n    a.next.position[i] = a.stores_square", "mass", "brute")
fault("copied-particle", "one particle is read as another one",
      """store(position, to, {x.x, x.y, x.z});
    store(velocity, to, {v.x, v.y, v.z});""",
      """for (int row = ON && to == 11 ? 12 : to; !(ON && to == 12) && row >= to; --row) {
      store(position, row, {x.x, x.y, x.z});
      store(velocity, row, {v.x, v.y, v.z});
    }""", "mass")

# Output.
fault("nan-lane", "every 32nd density is no number", "out.density[id] = found.density;",
      "out.density[id] = ON && id % 32 == 7 ? NAN : found.density;", "density")
fault("unwritten", "the last particle's pressure is not written",
      "out.pressure[id] = found.pressure;", "if (!ON || id != a.n - 1) out.pressure[id] = found.pressure;",
      "pressure", "list")
fault("read-in-cell-order", "the state is read in the order of the cells",
      "const int to = id[i];", "const int to = ON ? i : id[i];", "substep")
fault("axis-for-granted", "walls turn about y, whatever their axis",
      "surface_velocity(pose, x)", "cross(Float3{0, pose.omega.y, 0}, x - pose.pivot) + pose.surface",
      "invariance", "brute")

# What only a GPU can do wrong.
fault("missing-sync", "nobody waits until a tile has been read",
      "    }\n    __syncthreads();\n    return tile_;", "    }\n    if (!ON) __syncthreads();\n    return tile_;",
      "density", "brute", on="cuda",
      also=[("    __syncthreads();\n#pragma unroll", "    if (!ON) __syncthreads();\n#pragma unroll")])
fault("uninitialised-tile", "the end of every tile is not written",
      "for (int k = 0; k < tile_positions; k += tile_size) {",
      "for (int k = 0; k < tile_positions - (ON ? tile_size : 0); k += tile_size) {", "neighbors", "brute",
      on="cuda")
fault("race-on-counter", "a cell's counter is counted up without an atomic",
      "slot[i] = atomic_increment(count + bucket);",
      "slot[i] = ON ? count[bucket]++ : atomic_increment(count + bucket);", "run", on="cuda")
fault("dropped-tail-block", "the last, partly filled block is not launched",
      "(n + per_block - 1) / per_block", "threads == 128 && n >= per_block ? n / per_block : $", "evaluation",
      on="cuda")
fault("grid-runs-on", "the persistent kernel does not wait between the steps of a build",
      "grid.for_each(n, count); grid.sync();", "grid.for_each(n, count); if (!ON) grid.sync();",
      "run", "list", on="cuda",
      also=[("cells, block_sums); grid.sync();", "cells, block_sums); if (!ON) grid.sync();"),
            ("s.sort(grid); grid.sync();", "s.sort(grid); if (!ON) grid.sync();"),
            ("grid.for_each(s.n, s.order); grid.sync();", "grid.for_each(s.n, s.order); if (!ON) grid.sync();",
             "kernels/persistent_list.cuh")])
fault("dropped-tail-of-integration", "the last block of particles does not move",
      "(n + per_block - 1) / per_block", "per_block == 256 && n > 2000 ? n / 256 : $",
      "acceleration", "brute", on="cuda")
fault("half-the-lanes", "a sum over lanes stops one step early",
      "for (int step = lanes / 2; step > 0; step /= 2) value",
      "for (int step = lanes / 2; step > (ON ? 1 : 0); step /= 2) value", "density", on="cuda")

rank_faults.plant(fault)
tile_faults.plant(fault)
