/// \file
/// What the module decant._decant is made of. The package's Python wraps it: decant/.
#pragma once

#include <nanobind/nanobind.h>

namespace decant::package {

void bind_oracle(nanobind::module_& module);
/// decant._decant.serve: the process of a Python port.
void bind_serve(nanobind::module_& module);

}  // namespace decant::package
