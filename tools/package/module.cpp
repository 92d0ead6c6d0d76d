/// \file
/// Errors of users arrive as decant.InputError, a ValueError; errors of solvers as decant.BackendError, a RuntimeError.
#include "tools/package/module.hpp"

#include "reference/error.hpp"
#include "tools/package/scene_type.hpp"

NB_MODULE(_decant, module) {
  namespace nb = nanobind;
  nb::exception<decant::InputError>(module, "InputError", PyExc_ValueError);
  nb::exception<decant::BackendError>(module, "BackendError", PyExc_RuntimeError);
  decant::package::bind_scene(module);
  decant::package::bind_oracle(module);
  decant::package::bind_serve(module);
}
