// Makes a plug-in of a solver that has the members of AllPairs, whose header comes before: contact, status, the table.
#pragma once

#include "oracle/plugin.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>

template <class Solver>
struct PluginOf : Solver {
  using Solver::s, Solver::x, Solver::v, Solver::substep, Solver::density, Solver::pressure, Solver::parts;
  std::string error;
  decant_scene volumes_of{};  // the scene that they were found in

  /// Out of a solid at distance phi along n, whose surface moves with wall_velocity(x).
  template <class Velocity>
  void project(Vec& xi, Vec& vi, float phi, const Vec& n, Velocity wall_velocity) const {
    xi += (static_cast<float>(s.contact_distance) - phi) * n;
    const Vec wall = wall_velocity(xi), u = vi - wall, along = u - u.dot(n) * n;
    if (u.dot(n) >= 0) return;
    const float J = (1 + static_cast<float>(s.restitution)) * -u.dot(n), slip = along.norm();
    vi = wall + (u.dot(n) + J) * n;
    if (slip > 0) vi += std::fmax(0.0f, 1 - static_cast<float>(s.friction) * J / slip) * along;
  }
  void collide(const std::vector<WallMotion>& walls, Vec& xi, Vec& vi) const {
    for (int k = 0; k < s.containers; ++k)
      for (int turn = 0; turn < 2; ++turn) {
        const WallMotion& wall = walls[static_cast<std::size_t>(k)];
        const Eigen::Vector3d local = (wall.rotation.transpose() * (xi - wall.translation)).template cast<double>();
        Eigen::Vector3d normal;
        const double phi = s.distance(s.host, k, local.data(), normal.data());
        if (phi >= s.contact_distance) break;
        project(xi, vi, static_cast<float>(phi), wall.rotation * normal.cast<float>(),
                [&](const Vec& at) { return wall.velocity_at(at); });
      }
    if (s.has_floor && xi.z() - s.floor_height < s.contact_distance)
      project(xi, vi, xi.z() - static_cast<float>(s.floor_height), Vec::UnitZ(),
              [](const Vec&) { return Vec(Vec::Zero()); });
  }
  void step(decant_status& status) {
    this->find_densities(), this->find_forces(), ++substep;
    const auto walls = this->motions(substep);
    for (std::size_t i = 0; i < x.size(); ++i) {
      v[i] += static_cast<float>(s.time_step) * this->acceleration(i), x[i] += static_cast<float>(s.time_step) * v[i];
      for (int a = 0; a < 3; ++a)
        if (s.periodic[a])
          x[i][a] -= this->period(a) * std::floor((x[i][a] - static_cast<float>(s.domain_min[a])) / this->period(a));
      collide(walls, x[i], v[i]);
      bool outside = false;
      for (int a = 0; a < 3; ++a)
        outside |= !s.periodic[a] &&
                   !(x[i][a] >= static_cast<float>(s.domain_min[a]) && x[i][a] <= static_cast<float>(s.domain_max[a]));
      if (!x[i].allFinite() || !v[i].allFinite()) report(status, DECANT_NON_FINITE, i);
      else if (outside) report(status, DECANT_ESCAPED, i);
    }
  }
  void report(decant_status& status, std::uint32_t bit, std::size_t i) const {
    if (status.bits == 0) status.particle = static_cast<std::int64_t>(i), status.substep = substep;
    status.bits |= bit;
  }

  static PluginOf& of(void* solver) { return *static_cast<PluginOf*>(solver); }

  static int create(const char* options, void** solver) {
    auto* p = new PluginOf;
    *solver = p;
    std::istringstream all(options);
    for (std::string option; std::getline(all, option, ':') && p->error.empty();) {
      const auto equals = option.find('=');
      if (!p->option(option.substr(0, equals), option.substr(equals + 1)))
        p->error = "option " + option + ": not known";
    }
    return p->error.empty() ? 0 : 1;
  }
  static void destroy(void* solver) { delete &of(solver); }
  static const char* last_error(void* solver) { return solver ? of(solver).error.c_str() : ""; }

  static int load(void* solver, const decant_scene* scene, const decant_walls* walls, const decant_state* state) {
    PluginOf& p = of(solver);
    const auto take = [](std::vector<Vec>& to, const double* from, std::int64_t n) {
      to.clear();
      for (std::int64_t i = 0; i < n; ++i) to.push_back(WallMotion::vec(from + 3 * i));
    };
    p.s = *scene, p.substep = state->substep;
    p.H = static_cast<float>(scene->support_radius), p.h = 0.5f * p.H, p.m = static_cast<float>(scene->particle_mass);
    take(p.x, state->position, state->count), take(p.v, state->velocity, state->count);
    const auto [walls_before, containers_before] = std::pair(p.wall_local, p.container);
    take(p.wall_local, walls->position, walls->count);
    p.container.assign(walls->container, walls->container + walls->count);
    // The same scene comes again and again.
    if (p.wall_local != walls_before || p.container != containers_before || p.volumes_of.kernel != scene->kernel ||
        p.volumes_of.support_radius != scene->support_radius)
      p.find_volumes();
    p.volumes_of = *scene;
    p.loaded();
    return 0;
  }

  static int evaluate(void* solver, const decant_given* given, decant_fields* out, decant_status* status) {
    PluginOf& p = of(solver);
    const std::size_t n = p.x.size();
    p.find_densities();
    for (std::size_t i = 0; i < n && given && given->density; ++i)
      p.pressure[i] = p.pressure_at(p.density[i] = static_cast<float>(given->density[i]));
    std::ranges::copy(p.pressure, out->pressure);  // always that of the density in use
    for (std::size_t i = 0; i < n && given && given->pressure; ++i)
      p.pressure[i] = static_cast<float>(given->pressure[i]);
    p.find_forces();
    std::ranges::copy(p.volume, out->boundary_volume), std::ranges::copy(p.density, out->density);
    std::ranges::copy(p.fluid_count, out->fluid_neighbor_count);
    std::ranges::copy(p.fluid_sum, out->fluid_neighbor_id_sum);
    std::ranges::copy(p.wall_count, out->wall_neighbor_count);
    std::ranges::copy(p.wall_sum, out->wall_neighbor_id_sum);
    for (std::size_t i = 0; i < n; ++i) {
      const auto put = [i](const Vec& a, double* to) { Eigen::Map<Eigen::Vector3d>(to + 3 * i) = a.cast<double>(); };
      put(p.parts[i].pressure, out->pressure_acceleration), put(p.parts[i].viscous, out->viscous_acceleration);
      put(p.parts[i].wall_pressure, out->wall_pressure_acceleration);
      put(p.parts[i].wall_viscous, out->wall_viscous_acceleration);
      put(p.acceleration(i), out->acceleration);
      if (!p.x[i].allFinite() || !p.acceleration(i).allFinite()) p.report(*status, DECANT_NON_FINITE, i);
    }
    return 0;
  }

  static int advance(void* solver, std::int64_t substeps, decant_status* status) {
    for (std::int64_t k = 0; k < substeps && status->bits == 0; ++k) of(solver).step(*status);
    return 0;
  }
  static int read(void* solver, double* position, double* velocity) {
    for (std::size_t i = 0; i < of(solver).x.size(); ++i) {
      Eigen::Map<Eigen::Vector3d>(position + 3 * i) = of(solver).x[i].template cast<double>();
      Eigen::Map<Eigen::Vector3d>(velocity + 3 * i) = of(solver).v[i].template cast<double>();
    }
    return 0;
  }

  /// Member by member, so that it compiles when the table has grown.
  static decant_plugin_table table(const char* name) {
    decant_plugin_table t{};
    t.abi = DECANT_PLUGIN_ABI, t.size = sizeof t, t.name = name, t.precision = "fp32", t.offers = Solver::offers;
    t.create = create, t.destroy = destroy, t.load = load, t.evaluate = evaluate, t.advance = advance, t.read = read;
    t.last_error = last_error, t.device = [](void* solver) -> const char* { return of(solver).device_name(); };
    if constexpr (requires(Solver& p, decant_lists& lists) { p.lists(lists); })
      t.lists = [](void* solver, decant_lists* lists) { return of(solver).lists(*lists), 0; };
    return t;
  }
};
