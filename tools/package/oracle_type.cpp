/// \file
/// decant.Oracle: the reference solver in this process, and the tolerances that it gives a port.
#include "oracle/plugin/field_table.hpp"
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
  for (const plugin::RealField& field : plugin::real_fields)
    out[field.name] = field.scalar ? to_numpy(f.*field.scalar) : to_numpy(f.*field.vector);
  for (const plugin::CountField& field : plugin::count_fields) out[field.name] = to_numpy(f.*field.ours);
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
