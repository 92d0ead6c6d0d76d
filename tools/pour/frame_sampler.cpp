/// \file
/// Runs on the sampler's thread, but for what hands over to it.
#include "tools/pour/frame_sampler.hpp"

#include "tools/frames/make_frame.hpp"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <utility>

namespace decant::pour {
namespace {

/// What a look at walls found, joined to what another one found.
void keep_worst(AuditResult& all, const AuditResult& one) {
  if (one.deepest > all.deepest) {
    all.deepest = one.deepest;
    all.deepest_particle = one.deepest_particle;
  }
  all.inside = std::max(all.inside, one.inside);
  all.crossed += one.crossed;
  if (all.first_crossed < 0) all.first_crossed = one.first_crossed;
  all.max_speed = std::max(all.max_speed, one.max_speed);
}

std::int64_t fastest_in(const ParticleState& state) {
  Eigen::Index fastest = -1;
  if (state.size() > 0) state.velocity.colwise().squaredNorm().maxCoeff(&fastest);
  return fastest;
}

}  // namespace

FrameSampler::FrameSampler(const Scene& scene, const frames::Layout& layout, Outputs outputs)
    : scene_(scene), layout_(layout), outputs_(std::move(outputs)), audit_(scene) {}

void FrameSampler::resume(const SharedState& state, std::vector<TimelineRow> rows,
                          const std::optional<PartOfFrame>& part) {
  rows_ = std::move(rows);
  last_ = state;
  if (part) {
    on_the_way_ = part->on_the_way;
    fastest_on_the_way_ = part->fastest_particle;
    auto looked_at = std::make_shared<ParticleState>(*state);
    looked_at->substep = part->looked_at_substep;
    looked_at->position = part->looked_at;
    last_ = looked_at;
  }
  // Paths to the next look start at the last one.
  (void)audit_.sample(*last_);
}

void FrameSampler::within_frame(SharedState state) {
  thread_.push([this, state = std::move(state)] {
    const AuditResult seen = sample(state);
    if (seen.max_speed > on_the_way_.max_speed) fastest_on_the_way_ = fastest_in(*state);
    keep_worst(on_the_way_, seen);
  });
}

void FrameSampler::end_of_frame(SharedState state, Fields fields, const FrameTimes& times) {
  thread_.push([this, state = std::move(state), fields = std::make_shared<const Fields>(std::move(fields)), times] {
    write(state, *fields, times);
  });
}

AuditResult FrameSampler::sample(const SharedState& state) {
  last_ = state;
  return audit_.sample(*state);
}

void FrameSampler::write(const SharedState& state, const Fields& fields, const FrameTimes& times) {
  frames::Frame frame;
  AuditResult audit;
  TimelineRow row;
  Fields next;
  tbb::parallel_invoke(
      [&] {
        frame = frames::make_frame(scene_, layout_, times.frame, *state, fields);
        outputs_.write_values(frame);
      },
      [&] {
        audit = sample(state);
        const bool fastest_now = audit.max_speed >= on_the_way_.max_speed;
        keep_worst(audit, on_the_way_);
        row = timeline_row(times.frame, scene_, *state, fields, audit);
        row.fastest_particle = fastest_now ? fastest_in(*state) : fastest_on_the_way_;
      },
      [&] { next = Fields::unwritten(state->size(), fields.boundary_volume.size()); });
  row.solver_seconds = times.solver_seconds;
  row.wall_seconds = times.wall_seconds;
  on_the_way_ = {};
  fastest_on_the_way_ = -1;
  frame.place = std::move(audit.region);
  outputs_.complete(frame);
  rows_.push_back(row);
  outputs_.tell(row);
  const std::lock_guard lock(mutex_);
  unwritten_ = std::move(next);
}

PartOfFrame FrameSampler::part_of_frame() const {
  PartOfFrame part;
  part.looked_at = last_->position;
  part.looked_at_substep = last_->substep;
  part.on_the_way = on_the_way_;
  part.fastest_particle = fastest_on_the_way_;
  return part;
}

Fields FrameSampler::unwritten(Eigen::Index fluid, Eigen::Index wall) {
  const std::lock_guard lock(mutex_);
  if (!unwritten_ || unwritten_->density.size() != fluid || unwritten_->boundary_volume.size() != wall)
    return Fields::unwritten(fluid, wall);
  Fields fields = std::move(*unwritten_);
  unwritten_.reset();
  return fields;
}

}  // namespace decant::pour
