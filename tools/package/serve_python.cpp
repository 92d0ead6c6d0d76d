/// \file
/// A Python object as a plug-in: a table whose functions call its methods. The object (decant/serve.py) has checked
/// shapes and brought arrays to the host.
#include "oracle/plugin/field_table.hpp"
#include "oracle/plugin/serve.hpp"
#include "tools/package/arrays.hpp"
#include "tools/package/module.hpp"
#include "tools/package/scene_type.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace decant::package {
namespace {

/// The port, and what has to outlive a call.
struct PythonPort {
  nb::object port;
  std::string name, precision, device, error;
  std::array<std::vector<std::int64_t>, 2> offsets;
  std::array<std::vector<std::int32_t>, 2> entries;
};

PythonPort& of(void* solver) { return *static_cast<PythonPort*>(solver); }

/// 0, or 1 and the text of what was raised.
template <class Work>
int guarded(void* solver, Work work) {
  PythonPort& self = of(solver);
  try {
    work(self);
    return 0;
  } catch (nb::python_error& raised) {
    self.error = nb::cast<std::string>(self.port.attr("explain")(raised.value()));
  } catch (const std::exception& error) {
    self.error = error.what();
  }
  return 1;
}

void take_status(PythonPort& self, decant_status* status) {
  const auto [bits, particle, substep] = nb::cast<std::array<std::int64_t, 3>>(self.port.attr("take_status")());
  if (bits == 0) return;
  status->bits = static_cast<std::uint32_t>(bits);
  status->particle = particle;
  status->substep = substep;
}

int load(void* solver, const decant_scene* scene, const decant_walls* walls, const decant_state* state) {
  return guarded(solver, [&](PythonPort& self) {
    SceneType given;
    given.flat = *scene;
    const auto m = static_cast<std::size_t>(walls->count), n = static_cast<std::size_t>(state->count);
    self.port.attr("load")(nb::cast(std::move(given)), numpy_copy(walls->position, {m, 3}),
                           numpy_copy(walls->container, {m}), numpy_copy(state->position, {n, 3}),
                           numpy_copy(state->velocity, {n, 3}), state->substep);
  });
}

int evaluate(void* solver, const decant_given* given, decant_fields* out, decant_status* status) {
  return guarded(solver, [&](PythonPort& self) {
    const auto n = static_cast<std::size_t>(out->fluid), m = static_cast<std::size_t>(out->walls);
    const auto array = [](const double* values, std::size_t size) {
      return values ? numpy_copy(values, {size}) : nb::object(nb::none());
    };
    const auto fields = nb::cast<nb::dict>(self.port.attr("evaluate")(
        array(given ? given->boundary_volume : nullptr, m), array(given ? given->density : nullptr, n),
        array(given ? given->pressure : nullptr, n)));
    for (const plugin::RealField& field : plugin::real_fields)
      if (fields.contains(field.name))
        copy_out(nb::cast<Reals>(fields[field.name]), field.size(n, m), out->*field.theirs, field.name);
    for (const plugin::CountField& field : plugin::count_fields)
      if (fields.contains(field.name))
        copy_out(nb::cast<Integers>(fields[field.name]), n, out->*field.theirs, field.name);
    take_status(self, status);
  });
}

int advance(void* solver, std::int64_t substeps, decant_status* status) {
  return guarded(solver, [&](PythonPort& self) {
    self.port.attr("advance")(substeps);
    take_status(self, status);
  });
}

int read(void* solver, double* position, double* velocity) {
  return guarded(solver, [&](PythonPort& self) {
    const auto [x, v] = nb::cast<std::pair<Reals, Reals>>(self.port.attr("read")());
    std::copy_n(x.data(), x.size(), position);
    std::copy_n(v.data(), v.size(), velocity);
  });
}

int lists(void* solver, decant_lists* out) {
  return guarded(solver, [&](PythonPort& self) {
    const nb::object given = self.port.attr("lists")();
    out->built = nb::cast<std::int64_t>(given[0]);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto offsets = nb::cast<Integers>(given[1 + 2 * k]), entries = nb::cast<Integers>(given[2 + 2 * k]);
      self.offsets[k].assign(offsets.data(), offsets.data() + offsets.size());
      self.entries[k].assign(entries.data(), entries.data() + entries.size());
    }
    out->fluid_offsets = self.offsets[0].data();
    out->fluid = self.entries[0].data();
    out->wall_offsets = self.offsets[1].data();
    out->wall = self.entries[1].data();
  });
}

int stage_times(void* solver, decant_stage_times* out) {
  return guarded(solver, [&](PythonPort& self) {
    const nb::object times = self.port.attr("stage_times")();
    const std::array<double*, 4> seconds{&out->build, &out->density, &out->force, &out->integrate};
    const std::array<std::int64_t*, 4> calls{&out->build_calls, &out->density_calls, &out->force_calls,
                                             &out->integrate_calls};
    for (std::size_t k = 0; k < 4; ++k) {
      *seconds[k] = nb::cast<double>(times[2 * k]);
      *calls[k] = nb::cast<std::int64_t>(times[2 * k + 1]);
    }
    out->rebuilds = nb::cast<std::int64_t>(times[8]);
  });
}

void serve(int socket, const nb::callable& make) {
  // Owned here, so that it outlives the loop: the table's texts are its.
  PythonPort self;
  serve_plugin(socket, [&] {
    try {
      self.port = make();
    } catch (nb::python_error& raised) {
      throw std::runtime_error(nb::str(raised.value()).c_str());
    }
    const auto text = [&](const char* name) { return nb::cast<std::string>(self.port.attr(name)); };
    self.name = text("name");
    self.precision = text("precision");
    self.device = text("device");
    decant_plugin_table table{};
    table.abi = DECANT_PLUGIN_ABI;
    table.size = sizeof table;
    table.name = self.name.c_str();
    table.precision = self.precision.c_str();
    table.offers = nb::cast<std::uint32_t>(self.port.attr("offers"));
    table.destroy = [](void*) {};
    table.load = load;
    table.evaluate = evaluate;
    table.advance = advance;
    table.read = read;
    table.last_error = [](void* solver) { return of(solver).error.c_str(); };
    table.device = [](void* solver) { return of(solver).device.c_str(); };
    table.bytes = [](void* solver) -> std::int64_t {
      try {
        return nb::cast<std::int64_t>(of(solver).port.attr("bytes")());
      } catch (...) {
        return 0;
      }
    };
    table.lists = lists;
    table.stage_times = stage_times;
    return OpenPlugin{table, &self};
  });
}

}  // namespace

void bind_serve(nb::module_& module) {
  module.def("serve", serve, nb::arg("socket"), nb::arg("make"),
             "Answers a command's requests over a socket with the port that make() gives, until nobody asks any more.");
}

}  // namespace decant::package
