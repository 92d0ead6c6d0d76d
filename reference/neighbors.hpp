/// \file
/// Who is a neighbor: j ≠ i with |x_i − x_j|² < H². Decided here and nowhere else. The search over
/// all pairs is the definition; the search by cells gives the same lists in the same order, so that
/// every sum that follows has the same bits.
#pragma once

#include "reference/scene.hpp"

#include <cstdint>
#include <vector>

namespace decant {

/// For every fluid particle the ids of its neighbors, ascending; self excluded.
struct Neighbors {
  std::vector<std::vector<std::int32_t>> fluid, wall;
};

/// x_i − x_j, by the nearest image on periodic axes.
class Separation {
 public:
  explicit Separation(const Domain& domain) {
    for (int a = 0; a < 3; ++a)
      if (domain.periodic[a]) {
        period_[a] = domain.max[a] - domain.min[a];
        any_ = true;
      }
  }

  template <class Vector>
  Vector operator()(const Vector& x_i, const Vector& x_j) const {
    using Real = typename Vector::Scalar;
    Vector x_ij = x_i - x_j;
    if (any_)
      for (int a = 0; a < 3; ++a)
        // Nearer than half a period nothing is to be rounded.
        if (const auto period = static_cast<Real>(period_[a]); period > 0 && !(std::abs(x_ij[a]) < period / 2))
          x_ij[a] -= period * std::round(x_ij[a] / period);
    return x_ij;
  }

 private:
  Vec3 period_ = Vec3::Zero();
  bool any_ = false;
};

/// How the lists are found; the answer is the same.
enum class NeighborSearch { all_pairs, cells };

/// Lists of every fluid particle; vectors in `out` keep their capacity from call to call.
/// \param fluid  3×N, m, finite; \param wall  3×M, m, world
void find_neighbors(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                    NeighborSearch search, Neighbors& out);

/// The same lists, and in `near_H` the pairs with H − shell <= r < H + shell, from one search.
/// \param shell  m, > 0
void find_neighbors_and_shell(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                              double shell, Neighbors& out, Neighbors& near_H);

}  // namespace decant
