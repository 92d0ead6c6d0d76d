/// \file
/// Arrays across the border: NumPy's [N,3] in rows is Eigen's 3×N in columns. Both ways are copies.
#pragma once

#include "reference/state.hpp"

#include <nanobind/ndarray.h>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <stdexcept>
#include <string>

namespace decant::package {

namespace nb = nanobind;

using Reals = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Vectors = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Integers = nb::ndarray<const std::int64_t, nb::c_contig, nb::device::cpu>;

/// A NumPy array of its own memory.
template <class T>
nb::object numpy_copy(const T* values, std::initializer_list<std::size_t> shape) {
  std::size_t size = 1;
  for (const std::size_t n : shape) size *= n;
  T* copy = new T[size];
  std::copy_n(values, size, copy);
  const nb::capsule owner(copy, [](void* data) noexcept { delete[] static_cast<T*>(data); });
  return nb::ndarray<nb::numpy, T>(copy, shape, owner).cast();
}
inline nb::object to_numpy(const Eigen::Matrix3Xd& m) {
  return numpy_copy(m.data(), {static_cast<std::size_t>(m.cols()), 3});
}
inline nb::object to_numpy(const Eigen::VectorXd& v) {
  return numpy_copy(v.data(), {static_cast<std::size_t>(v.size())});
}
inline nb::object to_numpy(const IdVector& v) { return numpy_copy(v.data(), {static_cast<std::size_t>(v.size())}); }

inline Eigen::Matrix3Xd to_matrix(const Vectors& values) {
  return Eigen::Map<const Eigen::Matrix3Xd>(values.data(), 3, static_cast<Eigen::Index>(values.shape(0)));
}

/// As many values as are wanted, where they are wanted. Throws std::runtime_error.
template <class Array, class T>
void copy_out(const Array& values, std::size_t size, T* to, const char* name) {
  if (values.size() != size)
    throw std::runtime_error(std::string(name) + " has " + std::to_string(values.size()) + " values, not " +
                             std::to_string(size));
  std::copy_n(values.data(), size, to);
}

}  // namespace decant::package
