/// \file
/// Minimising: a failure is made as small as it stays one. First particles leave, by halves, quarters and
/// so on to one (Zeller & Hildebrandt, IEEE Trans. Softw. Eng. 28 (2002), `ddmin`), then what is around
/// them is made plain, then every number goes towards 0 by halves; over again as long as that helps.
#include "reference/scene_checks.hpp"
#include "tools/fuzz/campaign.hpp"

#include <algorithm>
#include <chrono>

namespace decant::fuzz {
namespace {

class Minimising {
 public:
  Minimising(Tester& tester, Counterexample found, int most_tries, double seconds, const std::function<bool()>& stop)
      : tester_(tester),
        best_(std::move(found)),
        most_(most_tries),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))),
        stop_(stop) {}

  Counterexample run() {
    best_.found_particles = best_.fuzz_case.points.size();
    for (bool smaller = true; smaller && best_.tries < most_;) {
      const Case before = best_.fuzz_case;
      drop_particles();
      make_plain();
      lower_numbers();
      smaller = best_.fuzz_case != before;
    }
    return best_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Takes the candidate where it fails as the one found does.
  bool take(const Case& candidate) {
    if (candidate == best_.fuzz_case || best_.tries >= most_ || Clock::now() >= end_ || (stop_ && stop_()))
      return false;
    ++best_.tries;
    Outcome outcome;
    try {
      check_scene(fixture_of(candidate, "fuzz").scene, "fuzz");
      outcome = tester_.test_one(candidate, best_.seed, best_.outcome);
    } catch (const std::exception&) {
      return false;  // no scene
    }
    if (outcome.holds) return false;
    best_.fuzz_case = candidate;
    best_.outcome = outcome;
    return true;
  }

  void drop_particles() {
    for (std::size_t chunk = std::max<std::size_t>(best_.fuzz_case.points.size() / 2, 1); chunk > 0; chunk /= 2)
      for (std::size_t from = 0; from < best_.fuzz_case.points.size();) {
        Case fewer = best_.fuzz_case;
        const auto first = fewer.points.begin() + static_cast<std::ptrdiff_t>(from);
        const auto count = std::min(chunk, fewer.points.size() - from);
        fewer.points.erase(first, first + static_cast<std::ptrdiff_t>(count));
        if (!take(fewer)) from += chunk;
      }
  }

  template <class Change>
  void attempt(Change change) {
    Case plainer = best_.fuzz_case;
    change(plainer);
    take(plainer);
  }

  /// Without a container; its particles go to the first room.
  static void drop_vessel(Case& g, std::size_t k) {
    if (g.vessels.size() == 1) g.size = g.vessels[0].size;
    g.vessels.erase(g.vessels.begin() + static_cast<std::ptrdiff_t>(k));
    const int room = static_cast<int>(k);
    for (Point& p : g.points) p.room = p.room == room ? 0 : p.room - (p.room > room);
  }

  void drop_vessels() {
    for (std::size_t k = best_.fuzz_case.vessels.size(); k-- > 0;) attempt([k](Case& g) { drop_vessel(g, k); });
    for (std::size_t k = 0; k < best_.fuzz_case.vessels.size(); ++k) {
      const auto of = [k](auto change) { return [k, change](Case& g) { change(g.vessels[k]); }; };
      attempt(of([](Vessel& v) {
        v.tilts = 0;
        v.steps = {};
      }));
      attempt(of([](Vessel& v) { v.steps = {}; }));
      for (std::size_t last = best_.fuzz_case.vessels[k].steps.size(); last-- > 0;)
        attempt(of([last](Vessel& v) { v.steps.erase(v.steps.begin() + static_cast<std::ptrdiff_t>(last)); }));
      attempt(of([](Vessel& v) { v.rate = 0; }));
      attempt(of([](Vessel& v) { v.tilt_oscillation = {}; }));
      attempt(of([](Vessel& v) {
        v.translates = 0;
        v.translation_steps = {};
        v.velocity = {};
        v.translation_oscillation = {};
      }));
      attempt(of([](Vessel& v) { v.translation_steps = {}; }));
      attempt(of([](Vessel& v) { v.velocity = {}; }));
      attempt(of([](Vessel& v) { v.translation_oscillation = {}; }));
      attempt(of([](Vessel& v) { v.belt = {}; }));
      attempt(of([](Vessel& v) { v.pivot = {}; }));
      attempt(of([](Vessel& v) { v.axis = {0, 1, 0}; }));
      for (int Vessel::* number : {&Vessel::angle, &Vessel::start, &Vessel::gap, &Vessel::side})
        attempt(of([number](Vessel& v) { v.*number = 0; }));
      attempt(of([](Vessel& v) { v.shift = {}; }));
      attempt(of([](Vessel& v) { v.form = is_revolved(v.form) ? Form::cup : Form::tank; }));
      for (std::size_t a = 0; a < 3; ++a) attempt(of([a](Vessel& v) { v.size[a] = 5; }));
    }
  }

  void make_plain() {
    drop_vessels();
    attempt([](Case& g) { g.periodic = {}; });
    for (std::size_t a = 0; a < 3; ++a) attempt([a](Case& g) { g.periodic[a] = 0; });
    attempt([](Case& g) {
      g.offset = {};
      g.far = 0;
    });
    attempt([](Case& g) { g.far = 0; });
    for (int Case::* number :
         {&Case::floor, &Case::floor_gap, &Case::reversed, &Case::mass, &Case::rest_density, &Case::sound_speed,
          &Case::substep, &Case::friction, &Case::restitution, &Case::contact, &Case::tension, &Case::linear_state,
          &Case::viscosity, &Case::wall_viscosity, &Case::kernel, &Case::scale})
      attempt([number](Case& g) { g.*number = 0; });
    attempt([](Case& g) { g.gravity = Case{}.gravity; });
    attempt([](Case& g) { g.support = 4; });
    attempt([](Case& g) { g.layers = 1; });
    attempt([](Case& g) { g.courant = 4; });
    attempt([](Case& g) { g.frames = 1; });
    for (std::size_t a = 0; a < 3; ++a) attempt([a](Case& g) { g.size[a] = 5; });
    attempt([](Case& g) {
      for (Point& p : g.points) p.v = {};
    });
  }

  /// Whole lattice spacings first, then halves.
  void lower_numbers() {
    for (std::size_t i = 0; i < best_.fuzz_case.points.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        attempt([&](Case& g) { g.points[i].v[a] = 0; });
        for (int grain = 64; grain > 1; grain /= 4)
          attempt([&](Case& g) { g.points[i].x[a] = g.points[i].x[a] / grain * grain; });
      }
  }

  Tester& tester_;
  Counterexample best_;
  int most_;
  Clock::time_point end_;
  const std::function<bool()>& stop_;
};

}  // namespace

Counterexample minimise(Tester& tester, Counterexample found, int most_tries, double seconds,
                        const std::function<bool()>& stop) {
  return Minimising(tester, std::move(found), most_tries, seconds, stop).run();
}

}  // namespace decant::fuzz
