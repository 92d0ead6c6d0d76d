// A backend of this project behind the table of plug-ins, so that what the table and the process cost can be measured:
//   plugin:linked.so:fixture=PATH:backend=list:executor=cuda
// The scene that arrives is not looked at: it is the fixture's.
#include "oracle/files/fixture_file.hpp"
#include "oracle/plugin.h"
#include "reference/sampling.hpp"
#include "tools/commands/backend_choice.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <sstream>
#include <string>

namespace {

using namespace decant;

struct Linked {
  std::unique_ptr<Backend> backend;
  Fixture fixture;
  Walls walls;
  std::string error, device;
  Eigen::Index particles = 0;
};
Linked& of(void* solver) { return *static_cast<Linked*>(solver); }

template <class Work>
int guarded(void* solver, Work work) {
  try {
    work(of(solver));
    return 0;
  } catch (const std::exception& raised) {
    of(solver).error = raised.what();
    return 1;
  }
}

int create(const char* options, void** solver) {
  *solver = new Linked;
  return guarded(*solver, [&](Linked& p) {
    std::map<std::string, std::string> given{{"backend", "list"}, {"executor", "auto"}};
    std::istringstream all(options);
    for (std::string option; std::getline(all, option, ':');)
      given[option.substr(0, option.find('='))] = option.substr(option.find('=') + 1);
    p.fixture = read_fixture(given.at("fixture"));
    p.walls = sample_walls(p.fixture.scene);
    p.backend = choose_backend(given["backend"], given["executor"]);
    p.device = p.backend->info().device;
  });
}

void tell(const Status& status, decant_status* out) {
  if (!status.ok()) *out = {out->size, status.bits, status.particle, status.substep};
}

int load(void* solver, const decant_scene*, const decant_walls*, const decant_state* state) {
  return guarded(solver, [&](Linked& p) {
    const Eigen::Index n = p.particles = state->count;
    p.backend->load(p.fixture.scene, p.walls,
                    {state->substep, Eigen::Map<const Eigen::Matrix3Xd>(state->position, 3, n),
                     Eigen::Map<const Eigen::Matrix3Xd>(state->velocity, 3, n)});
  });
}

int evaluate(void* solver, const decant_given* given, decant_fields* out, decant_status* status) {
  return guarded(solver, [&](Linked& p) {
    StageInputs inputs;
    const auto take = [](const double* from, Eigen::Index n, Eigen::VectorXd& to) {
      if (from) to = Eigen::Map<const Eigen::VectorXd>(from, n);
    };
    if (given) {
      take(given->boundary_volume, out->walls, inputs.boundary_volume);
      take(given->density, out->fluid, inputs.density);
      take(given->pressure, out->fluid, inputs.pressure);
    }
    Fields f = Fields::unwritten(out->fluid, out->walls);
    tell(p.backend->evaluate(f, given ? &inputs : nullptr), status);
    const auto put = [](const auto& values, auto* to) { std::copy_n(values.data(), values.size(), to); };
    put(f.boundary_volume, out->boundary_volume), put(f.density, out->density), put(f.pressure, out->pressure);
    put(f.acceleration, out->acceleration), put(f.pressure_acceleration, out->pressure_acceleration);
    put(f.viscous_acceleration, out->viscous_acceleration);
    put(f.wall_pressure_acceleration, out->wall_pressure_acceleration);
    put(f.wall_viscous_acceleration, out->wall_viscous_acceleration);
    put(f.fluid_neighbor_count, out->fluid_neighbor_count), put(f.fluid_neighbor_id_sum, out->fluid_neighbor_id_sum);
    put(f.wall_neighbor_count, out->wall_neighbor_count), put(f.wall_neighbor_id_sum, out->wall_neighbor_id_sum);
  });
}

int advance(void* solver, std::int64_t substeps, decant_status* status) {
  return guarded(solver, [&](Linked& p) { tell(p.backend->advance(static_cast<int>(substeps)), status); });
}

int read(void* solver, double* position, double* velocity) {
  return guarded(solver, [&](Linked& p) {
    ParticleState state;
    p.backend->read(state);
    std::copy_n(state.position.data(), state.position.size(), position);
    std::copy_n(state.velocity.data(), state.velocity.size(), velocity);
  });
}

}  // namespace

const decant_plugin_table* decant_plugin(std::uint32_t) {
  static const decant_plugin_table table = [] {
    decant_plugin_table t{};
    t.abi = DECANT_PLUGIN_ABI, t.size = sizeof t, t.name = "linked", t.precision = "fp32", t.offers = 0x1FF;
    t.create = create, t.destroy = [](void* solver) { delete &of(solver); };
    t.load = load, t.evaluate = evaluate, t.advance = advance, t.read = read;
    t.last_error = [](void* solver) -> const char* { return solver ? of(solver).error.c_str() : ""; };
    t.device = [](void* solver) -> const char* { return of(solver).device.c_str(); };
    return t;
  }();
  return &table;
}
