/// \file
/// decant.Oracle: the reference solver in this process, and the tolerances that it gives a port.
#include "oracle/solution/reference_backend.hpp"
#include "oracle/solution/tolerance.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tools/package/arrays.hpp"
#include "tools/package/module.hpp"
#include "tools/package/scene_type.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <optional>

namespace decant::package {
namespace {

nb::dict to_dict(const Fields& f) {
  nb::dict out;
  out["boundary_volume"] = to_numpy(f.boundary_volume);
  out["density"] = to_numpy(f.density);
  out["pressure"] = to_numpy(f.pressure);
  out["acceleration"] = to_numpy(f.acceleration);
  out["pressure_acceleration"] = to_numpy(f.pressure_acceleration);
  out["viscous_acceleration"] = to_numpy(f.viscous_acceleration);
  out["wall_pressure_acceleration"] = to_numpy(f.wall_pressure_acceleration);
  out["wall_viscous_acceleration"] = to_numpy(f.wall_viscous_acceleration);
  out["fluid_neighbor_count"] = to_numpy(f.fluid_neighbor_count);
  out["fluid_neighbor_id_sum"] = to_numpy(f.fluid_neighbor_id_sum);
  out["wall_neighbor_count"] = to_numpy(f.wall_neighbor_count);
  out["wall_neighbor_id_sum"] = to_numpy(f.wall_neighbor_id_sum);
  return out;
}

class OracleType {
 public:
  explicit OracleType(const SceneType& scene)
      : scene_(scene.of_file()), walls_(sample_walls(scene_)), solver_(make_reference_backend(NeighborSearch::cells)) {}

  void load(const Vectors& position, const Vectors& velocity, std::int64_t substep) {
    if (position.shape(0) != velocity.shape(0)) throw nb::value_error("position and velocity differ in length");
    solver_->load(scene_, walls_, {substep, to_matrix(position), to_matrix(velocity)});
  }

  nb::dict evaluate(const std::optional<Reals>& density, const std::optional<Reals>& pressure) {
    StageInputs given;
    const auto take = [&](const std::optional<Reals>& values, Eigen::VectorXd& to, const char* name) {
      if (!values) return;
      to.resize(present().size());
      copy_out(*values, static_cast<std::size_t>(to.size()), to.data(), name);
    };
    if (pressure && !density) throw nb::value_error("pressure comes with density");
    take(density, given.density, "density");
    take(pressure, given.pressure, "pressure");
    Fields fields = Fields::unwritten(present().size(), walls_.size());
    const Status status = solver_->evaluate(fields, &given);
    if (!status.ok()) throw BackendError("the oracle: " + describe(status));
    return to_dict(fields);
  }

  nb::dict tolerance() {
    return to_dict(reference_solution(scene_, walls_, wall_solution(scene_, walls_), present()).tolerance);
  }

  void advance(int substeps) {
    if (substeps < 0) throw nb::value_error("substeps: 0 or more");
    if (const Status status = solver_->advance(substeps); !status.ok())
      throw BackendError("the oracle: " + describe(status));
  }

  nb::tuple read() {
    const ParticleState state = present();
    return nb::make_tuple(to_numpy(state.position), to_numpy(state.velocity), state.substep);
  }

 private:
  ParticleState present() const {
    ParticleState state;
    solver_->read(state);
    return state;
  }

  Scene scene_;
  Walls walls_;
  std::unique_ptr<Backend> solver_;
};

}  // namespace

void bind_oracle(nb::module_& module) {
  nb::class_<OracleType>(module, "Oracle")
      .def(nb::init<const SceneType&>(), nb::arg("scene"))
      .def("load", &OracleType::load, nb::arg("position"), nb::arg("velocity"), nb::arg("substep"))
      .def("evaluate", &OracleType::evaluate, nb::arg("density") = nb::none(), nb::arg("pressure") = nb::none())
      .def("tolerance", &OracleType::tolerance)
      .def("advance", &OracleType::advance, nb::arg("substeps"))
      .def("read", &OracleType::read);
}

}  // namespace decant::package
