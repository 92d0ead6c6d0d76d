/// \file
/// Both searches run through the neighbors j in ascending order and append j to the lists of all i
/// near it, so that every list comes out ascending without sorting.
#include "reference/neighbors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace decant {
namespace {

void clear(std::vector<std::vector<std::int32_t>>& lists, Eigen::Index n) {
  lists.resize(static_cast<std::size_t>(n));
  for (auto& list : lists) list.clear();
}

void search_all_pairs(const Scene& scene, const Eigen::Matrix3Xd& fluid,
                      const Eigen::Matrix3Xd& wall, Neighbors& out) {
  const Separation separation(scene.domain);
  const double squared_support = scene.support_radius() * scene.support_radius();
  const auto n = static_cast<std::int32_t>(fluid.cols()), m = static_cast<std::int32_t>(wall.cols());
  for (std::int32_t j = 0; j < n; ++j) {
    const Vec3 x_j = fluid.col(j);
    for (std::int32_t i = j + 1; i < n; ++i)
      if (separation(Vec3(fluid.col(i)), x_j).squaredNorm() < squared_support) {
        out.fluid[i].push_back(j);
        out.fluid[j].push_back(i);
      }
  }
  for (std::int32_t i = 0; i < n; ++i) {
    const Vec3 x_i = fluid.col(i);
    for (std::int32_t b = 0; b < m; ++b)
      if (separation(x_i, Vec3(wall.col(b))).squaredNorm() < squared_support)
        out.wall[i].push_back(b);
  }
}

/// Fluid particles sorted by cell, cells at least H wide.
class CellList {
 public:
  CellList(const Scene& scene, const Eigen::Matrix3Xd& x) {
    const Domain& domain = scene.domain;
    periodic_ = domain.periodic;
    Vec3 high;
    for (int a = 0; a < 3; ++a) {
      low_[a] = periodic_[a] ? domain.min[a] : x.row(a).minCoeff();
      high[a] = periodic_[a] ? domain.max[a] : x.row(a).maxCoeff();
    }
    // A lone outlier must not cost memory: cells grow until there are few for each particle.
    // The margin keeps a rounded cell index from hiding a pair just inside H.
    double width = scene.support_radius() * (1 + 1e-9);
    const double most = 8.0 * static_cast<double>(x.cols()) + 64;
    for (;; width *= 1.5) {
      double cells = 1;
      for (int a = 0; a < 3; ++a) cells *= std::floor((high[a] - low_[a]) / width) + 1;
      if (cells <= most) break;
    }
    for (int a = 0; a < 3; ++a) {
      const double extent = high[a] - low_[a];
      count_[a] = std::max(1, static_cast<int>(std::floor(extent / width)));
      // Fewer than three cells around a period would be met twice.
      if (periodic_[a] && count_[a] < 3) count_[a] = 1;
      // The last cell takes the remainder, so that none is narrower than H.
      inverse_width_[a] = count_[a] > 1 ? count_[a] / extent : 0.0;
    }
    const std::size_t cells = static_cast<std::size_t>(count_[0]) * count_[1] * count_[2];
    std::vector<std::size_t> cell_of(static_cast<std::size_t>(x.cols()));
    start_.assign(cells + 1, 0);
    for (std::size_t i = 0; i < cell_of.size(); ++i) {
      const Vec3 x_i = x.col(static_cast<Eigen::Index>(i));
      cell_of[i] = index(cell_along(x_i, 0, 0, count_[0] - 1), cell_along(x_i, 1, 0, count_[1] - 1),
                         cell_along(x_i, 2, 0, count_[2] - 1));
      ++start_[cell_of[i] + 1];
    }
    for (std::size_t c = 0; c < cells; ++c) start_[c + 1] += start_[c];
    id_.resize(cell_of.size());
    position_.resize(3, x.cols());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < cell_of.size(); ++i) {
      const std::size_t k = next[cell_of[i]]++;
      id_[k] = static_cast<std::int32_t>(i);
      position_.col(static_cast<Eigen::Index>(k)) = x.col(static_cast<Eigen::Index>(i));
    }
  }

  /// visit(i, x_i) for every particle in the cells that a point's support can reach.
  template <class Visit>
  void near(const Vec3& x, Visit&& visit) const {
    std::array<int, 3> c, first, last;
    for (int a = 0; a < 3; ++a) {
      c[a] = cell_along(x, a, -2, count_[a] + 1);
      const bool around = periodic_[a] && count_[a] > 1;
      first[a] = around ? c[a] - 1 : std::max(c[a] - 1, 0);
      last[a] = around ? c[a] + 1 : std::min(c[a] + 1, count_[a] - 1);
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int along = first[0]; along <= last[0]; ++along) {
          const std::size_t cell = index(wrapped(along, 0), wrapped(y, 1), wrapped(z, 2));
          for (std::size_t k = start_[cell]; k < start_[cell + 1]; ++k)
            visit(id_[k], Vec3(position_.col(static_cast<Eigen::Index>(k))));
        }
  }

 private:
  /// Cell index along one axis: wrapped where the axis is periodic, else clamped to least … most.
  int cell_along(const Vec3& x, int a, int least, int most) const {
    const double c = std::floor((x[a] - low_[a]) * inverse_width_[a]);
    if (periodic_[a]) return static_cast<int>(c - count_[a] * std::floor(c / count_[a]));
    return static_cast<int>(std::clamp(c, static_cast<double>(least), static_cast<double>(most)));
  }
  int wrapped(int c, int a) const { return (c + count_[a]) % count_[a]; }
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * count_[1] + y) * count_[0] + x;
  }

  Vec3 low_, inverse_width_;
  std::array<int, 3> count_;
  std::array<bool, 3> periodic_;
  std::vector<std::size_t> start_;
  std::vector<std::int32_t> id_;
  Eigen::Matrix3Xd position_;
};

void search_cells(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                  Neighbors& out) {
  const Separation separation(scene.domain);
  const double squared_support = scene.support_radius() * scene.support_radius();
  const CellList cells(scene, fluid);
  for (std::int32_t j = 0; j < fluid.cols(); ++j) {
    const Vec3 x_j = fluid.col(j);
    cells.near(x_j, [&](std::int32_t i, const Vec3& x_i) {
      if (i != j && separation(x_i, x_j).squaredNorm() < squared_support) out.fluid[i].push_back(j);
    });
  }
  for (std::int32_t b = 0; b < wall.cols(); ++b) {
    const Vec3 x_b = wall.col(b);
    cells.near(x_b, [&](std::int32_t i, const Vec3& x_i) {
      if (separation(x_i, x_b).squaredNorm() < squared_support) out.wall[i].push_back(b);
    });
  }
}

}  // namespace

void find_neighbors(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                    NeighborSearch search, Neighbors& out) {
  clear(out.fluid, fluid.cols());
  clear(out.wall, fluid.cols());
  if (fluid.cols() == 0) return;
  if (search == NeighborSearch::all_pairs)
    search_all_pairs(scene, fluid, wall, out);
  else
    search_cells(scene, fluid, wall, out);
}

}  // namespace decant
