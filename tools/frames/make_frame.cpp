/// \file
/// Rounds to fp32.
#include "tools/frames/make_frame.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

namespace decant::frames {
namespace {

template <class Values>
std::vector<float> rounded(const Values& values) {
  std::vector<float> floats(static_cast<std::size_t>(values.size()));
  Eigen::Map<Eigen::Matrix<float, Values::RowsAtCompileTime, Eigen::Dynamic>>(
      floats.data(), values.rows(), values.cols()) = values.template cast<float>();
  return floats;
}

}  // namespace

Frame make_frame(const Scene& scene, const Layout& layout, std::int64_t index, const ParticleState& state,
                 const Fields& fields) {
  Frame frame;
  frame.index = index;
  frame.time = scene.time_at(state.substep);
  std::vector<std::size_t> moving;
  for (std::size_t c = 0; c < layout.walls.size(); ++c)
    if (layout.walls[c].moving) moving.push_back(c);
  frame.wall.resize(moving.size());
  tbb::parallel_invoke([&] { frame.position = rounded(state.position); },
                       [&] { frame.velocity = rounded(state.velocity); },
                       [&] {
                         frame.density = rounded(fields.density);
                         frame.pressure = rounded(fields.pressure);
                       },
                       [&] {
                         tbb::parallel_for(std::size_t{0}, moving.size(), [&](std::size_t w) {
                           const std::size_t c = moving[w];
                           frame.wall[w] = posed_vertices(scene.containers.at(c), layout.walls[c].surface, frame.time);
                         });
                       });
  return frame;
}

}  // namespace decant::frames
