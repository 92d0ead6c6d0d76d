/// \file
/// Both searches run through the neighbors j in ascending order and append j to the lists of all i
/// near it, so that every list comes out ascending without sorting.
#include "reference/neighbors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace decant {
namespace {

void clear(std::vector<std::vector<std::int32_t>>& lists, Eigen::Index n) {
  lists.resize(static_cast<std::size_t>(n));
  for (auto& list : lists) list.clear();
}

void search_all_pairs(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall, Neighbors& out) {
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
      if (separation(x_i, Vec3(wall.col(b))).squaredNorm() < squared_support) out.wall[i].push_back(b);
  }
}

/// Fluid particles sorted by cell, cells at least a radius wide.
class CellList {
 public:
  CellList(const Scene& scene, const Eigen::Matrix3Xd& x, double radius)
      : separation_(scene.domain), squared_radius_(radius * radius), reach_(radius * (1 + 1e-9)) {
    const Domain& domain = scene.domain;
    periodic_ = domain.periodic;
    any_periodic_ = periodic_[0] || periodic_[1] || periodic_[2];
    for (int a = 0; a < 3; ++a) {
      low_[a] = periodic_[a] ? domain.min[a] : x.row(a).minCoeff();
      high_[a] = periodic_[a] ? domain.max[a] : x.row(a).maxCoeff();
    }
    // A lone outlier must not cost memory: cells grow until there are few for each particle.
    // The margin keeps a rounded cell index from hiding a pair just inside the radius.
    double width = radius * (1 + 1e-9);
    const double most = 32.0 * static_cast<double>(x.cols()) + 4096;
    for (;; width *= 1.5) {
      double cells = 1;
      for (int a = 0; a < 3; ++a) cells *= std::floor((high_[a] - low_[a]) / width) + 1;
      if (cells <= most) break;
    }
    for (int a = 0; a < 3; ++a) {
      const double extent = high_[a] - low_[a];
      count_[a] = std::max(1, static_cast<int>(std::floor(extent / width)));
      // Fewer than three cells around a period would be met twice.
      if (periodic_[a] && count_[a] < 3) count_[a] = 1;
      // The last cell takes the remainder, so that none is narrower than the radius.
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
    for (auto& along : position_) along.resize(cell_of.size());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < cell_of.size(); ++i) {
      const std::size_t k = next[cell_of[i]]++;
      id_[k] = static_cast<std::int32_t>(i);
      for (int a = 0; a < 3; ++a) position_[a][k] = x(a, static_cast<Eigen::Index>(i));
    }
  }

  /// Ids of the particles within the radius of a point, in no order; there until the next call.
  std::span<const std::int32_t> within(const Vec3& x) {
    for (int a = 0; a < 3; ++a)
      if (!periodic_[a] && !(x[a] >= low_[a] - reach_ && x[a] <= high_[a] + reach_)) return {};
    std::array<int, 3> c, first, last;
    for (int a = 0; a < 3; ++a) {
      c[a] = cell_along(x, a, -2, count_[a] + 1);
      const bool around = periodic_[a] && count_[a] > 1;
      first[a] = around ? c[a] - 1 : std::max(c[a] - 1, 0);
      last[a] = around ? c[a] + 1 : std::min(c[a] + 1, count_[a] - 1);
    }
    std::size_t n = 0;
    const bool one_run = first[0] >= 0 && last[0] < count_[0];
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = index(0, wrapped(y, 1), wrapped(z, 2));
        if (one_run) {
          if (first[0] <= last[0]) n = add_run(row + first[0], row + last[0], x, n);
        } else {
          for (int along = first[0]; along <= last[0]; ++along)
            n = add_run(row + wrapped(along, 0), row + wrapped(along, 0), x, n);
        }
      }
    return {found_.data(), n};
  }

 private:
  /// Cells that follow each other along x hold their particles without a gap. Returns how many are found now.
  std::size_t add_run(std::size_t first_cell, std::size_t last_cell, const Vec3& x, std::size_t n) {
    const std::size_t begin = start_[first_cell], count = start_[last_cell + 1] - begin;
    if (found_.size() < n + count) found_.resize(2 * (n + count));
    if (squared_.size() < count) squared_.resize(2 * count);
    const double *const x_k = position_[0].data() + begin, *const y_k = position_[1].data() + begin,
                        *const z_k = position_[2].data() + begin;
    // Apart, and without a branch on what no processor can predict, both loops are fast.
    if (any_periodic_) {
      for (std::size_t k = 0; k < count; ++k) squared_[k] = separation_(Vec3(x_k[k], y_k[k], z_k[k]), x).squaredNorm();
    } else {
      for (std::size_t k = 0; k < count; ++k) {
        const double a = x_k[k] - x.x(), b = y_k[k] - x.y(), c = z_k[k] - x.z();
        squared_[k] = a * a + (b * b + c * c);  // as Eigen's squaredNorm, to the last bit
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      found_[n] = id_[begin + k];
      n += squared_[k] < squared_radius_;
    }
    return n;
  }
  /// Cell index along one axis: wrapped where the axis is periodic, else clamped to least … most.
  int cell_along(const Vec3& x, int a, int least, int most) const {
    const double c = std::floor((x[a] - low_[a]) * inverse_width_[a]);
    if (periodic_[a]) return static_cast<int>(c - count_[a] * std::floor(c / count_[a]));
    return static_cast<int>(std::clamp(c, static_cast<double>(least), static_cast<double>(most)));
  }
  int wrapped(int c, int a) const { return (c + count_[a]) % count_[a]; }
  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * count_[1] + y) * count_[0] + x; }

  Separation separation_;
  double squared_radius_, reach_;  // m², and m with room for rounding
  Vec3 low_, high_, inverse_width_;
  std::array<int, 3> count_;
  std::array<bool, 3> periodic_;
  bool any_periodic_;
  std::vector<std::uint32_t> start_;
  std::vector<std::int32_t> id_;
  std::array<std::vector<double>, 3> position_;
  // What one search needs.
  std::vector<std::int32_t> found_;
  std::vector<double> squared_;  // m²
};

/// Hands every ordered pair of fluid particles and every pair with a wall to a function, ids of the second
/// one ascending. \param add  (i, j, whether j is a wall)
template <class Add>
void search_cells(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall, double radius,
                  Add add) {
  CellList cells(scene, fluid, radius);
  for (std::int32_t j = 0; j < fluid.cols(); ++j)
    for (const auto i : cells.within(fluid.col(j)))
      if (i != j) add(i, j, false);
  for (std::int32_t b = 0; b < wall.cols(); ++b)
    for (const auto i : cells.within(wall.col(b))) add(i, b, true);
}

}  // namespace

void find_neighbors(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                    NeighborSearch search, Neighbors& out) {
  clear(out.fluid, fluid.cols());
  clear(out.wall, fluid.cols());
  if (fluid.cols() == 0) return;
  if (search == NeighborSearch::all_pairs) search_all_pairs(scene, fluid, wall, out);
  else
    search_cells(scene, fluid, wall, scene.support_radius(), [&](std::int32_t i, std::int32_t j, bool is_wall) {
      (is_wall ? out.wall : out.fluid)[i].push_back(j);
    });
}

void find_neighbors_and_shell(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                              double shell, Neighbors& out, Neighbors& near_H) {
  for (Neighbors* lists : {&out, &near_H}) {
    clear(lists->fluid, fluid.cols());
    clear(lists->wall, fluid.cols());
  }
  if (fluid.cols() == 0) return;
  const Separation separation(scene.domain);
  const double H = scene.support_radius(), squared_support = H * H;
  const double squared_least = H > shell ? (H - shell) * (H - shell) : 0;
  search_cells(scene, fluid, wall, H + shell, [&](std::int32_t i, std::int32_t j, bool is_wall) {
    const Vec3 x_i = fluid.col(i), x_j = is_wall ? wall.col(j) : fluid.col(j);
    const double squared = separation(x_i, x_j).squaredNorm();
    if (squared < squared_support) (is_wall ? out.wall : out.fluid)[i].push_back(j);
    if (squared >= squared_least) (is_wall ? near_H.wall : near_H.fluid)[i].push_back(j);
  });
}

}  // namespace decant
