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
      : separation_(scene.domain), squared_radius_(radius * radius) {
    const Domain& domain = scene.domain;
    periodic_ = domain.periodic;
    Vec3 high;
    for (int a = 0; a < 3; ++a) {
      low_[a] = periodic_[a] ? domain.min[a] : x.row(a).minCoeff();
      high[a] = periodic_[a] ? domain.max[a] : x.row(a).maxCoeff();
    }
    // A lone outlier must not cost memory: cells grow until there are few for each particle.
    // The margin keeps a rounded cell index from hiding a pair just inside the radius.
    double width = radius * (1 + 1e-9);
    const double most = 32.0 * static_cast<double>(x.cols()) + 4096;
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
    position_.resize(3, x.cols());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < cell_of.size(); ++i) {
      const std::size_t k = next[cell_of[i]]++;
      id_[k] = static_cast<std::int32_t>(i);
      position_.col(static_cast<Eigen::Index>(k)) = x.col(static_cast<Eigen::Index>(i));
    }
  }

  /// Ids of the particles within the radius of a point, in no order.
  void within(const Vec3& x, std::vector<std::int32_t>& found) const {
    found.clear();
    std::array<int, 3> c, first, last;
    for (int a = 0; a < 3; ++a) {
      c[a] = cell_along(x, a, -2, count_[a] + 1);
      const bool around = periodic_[a] && count_[a] > 1;
      first[a] = around ? c[a] - 1 : std::max(c[a] - 1, 0);
      last[a] = around ? c[a] + 1 : std::min(c[a] + 1, count_[a] - 1);
    }
    const bool one_run = first[0] >= 0 && last[0] < count_[0];
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = index(0, wrapped(y, 1), wrapped(z, 2));
        if (one_run) {
          if (first[0] <= last[0]) add_run(row + first[0], row + last[0], x, found);
        } else {
          for (int along = first[0]; along <= last[0]; ++along)
            add_run(row + wrapped(along, 0), row + wrapped(along, 0), x, found);
        }
      }
  }

 private:
  /// Cells that follow each other along x hold their particles without a gap.
  void add_run(std::size_t first_cell, std::size_t last_cell, const Vec3& x, std::vector<std::int32_t>& found) const {
    const std::size_t begin = start_[first_cell], end = start_[last_cell + 1];
    std::size_t n = found.size();
    found.resize(n + (end - begin));
    // No branch on what no processor can predict.
    for (std::size_t k = begin; k < end; ++k) {
      found[n] = id_[k];
      const Vec3 x_k = position_.col(static_cast<Eigen::Index>(k));
      n += separation_(x_k, x).squaredNorm() < squared_radius_;
    }
    found.resize(n);
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
  double squared_radius_;
  Vec3 low_, inverse_width_;
  std::array<int, 3> count_;
  std::array<bool, 3> periodic_;
  std::vector<std::uint32_t> start_;
  std::vector<std::int32_t> id_;
  Eigen::Matrix3Xd position_;
};

/// Hands every ordered pair of fluid particles and every pair with a wall to a function, ids of the second
/// one ascending. \param add  (i, j, whether j is a wall)
template <class Add>
void search_cells(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall, double radius,
                  Add add) {
  const CellList cells(scene, fluid, radius);
  std::vector<std::int32_t> near;
  for (std::int32_t j = 0; j < fluid.cols(); ++j) {
    cells.within(fluid.col(j), near);
    for (const auto i : near)
      if (i != j) add(i, j, false);
  }
  for (std::int32_t b = 0; b < wall.cols(); ++b) {
    cells.within(wall.col(b), near);
    for (const auto i : near) add(i, b, true);
  }
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
