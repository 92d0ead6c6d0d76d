/// \file
/// Numbers drawn.
#include "tools/fuzz/case.hpp"

#include <algorithm>

namespace decant::fuzz {
namespace {

/// splitmix64: whole numbers that are the same everywhere, which the library's distributions are not.
/// Source: Steele, Lea & Flood, OOPSLA 2014.
class Rng {
 public:
  /// The first number of one stream begins another, so that seeds in a row have nothing in common.
  explicit Rng(std::uint64_t seed) : state_(seed ^ 0xD6E8FEB86659FD93ull) { state_ = next(); }
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ z >> 27) * 0x94D049BB133111EBull;
    return z ^ z >> 31;
  }
  /// low … high, both included.
  int whole(int low, int high) { return low + static_cast<int>(next() % static_cast<std::uint64_t>(high - low + 1)); }
  bool in(int hundredths) { return whole(0, 99) < hundredths; }

 private:
  std::uint64_t state_;
};

/// The kinds of states.
enum class Kind { lattice, gas, crowd, coincident, cell_faces, outliers, few };

Kind kind_of(Rng& rng) {
  constexpr std::array<std::pair<Kind, int>, 7> shares = {{{Kind::lattice, 40},
                                                           {Kind::gas, 20},
                                                           {Kind::crowd, 8},
                                                           {Kind::coincident, 8},
                                                           {Kind::cell_faces, 8},
                                                           {Kind::outliers, 8},
                                                           {Kind::few, 8}}};
  int drawn = rng.whole(0, 99);
  for (const auto& [kind, share] : shares)
    if ((drawn -= share) < 0) return kind;
  return Kind::lattice;
}

/// Draws the points of a problem.
class Scattering {
 public:
  Scattering(Rng& rng, Case& g, Kind kind) : rng_(rng), g_(g), kind_(kind) {
    fastest_ = rng.in(10) ? 0 : 128;
    // Into walls, through them and about them.
    if (!g.vessels.empty() && rng.in(25)) beyond_ = g.layers + 2;
  }

  void draw() {
    draw_main_room();
    for (std::size_t k = 1; k < g_.vessels.size(); ++k) {
      beyond_ = g_.layers + 2;
      const std::size_t from = g_.points.size();
      scatter(rng_.whole(0, 60), g_.vessels[k].size);
      for (std::size_t i = from; i < g_.points.size(); ++i) g_.points[i].room = static_cast<int>(k);
    }
  }

 private:
  Point anywhere(const std::array<int, 3>& size) {
    Point p;
    for (std::size_t a = 0; a < 3; ++a) {
      const int more = g_.periodic[a] ? 0 : fine * beyond_;
      p.x[a] = rng_.whole(-more, fine * size[a] - 1 + more);
      p.v[a] = rng_.whole(-fastest_, fastest_);
    }
    return p;
  }

  void scatter(int count, const std::array<int, 3>& size) {
    for (int k = 0; k < count; ++k) g_.points.push_back(anywhere(size));
  }

  void lattice(const std::array<int, 3>& size) {
    const int jitter = rng_.in(50) ? 6 : 28, filled = rng_.whole(25, 100);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          if (!rng_.in(filled)) continue;
          Point p = anywhere(size);
          const std::array<int, 3> cell = {i, j, k};
          for (std::size_t a = 0; a < 3; ++a) p.x[a] = fine * cell[a] + fine / 2 + rng_.whole(-jitter, jitter);
          g_.points.push_back(p);
        }
  }

  void draw_main_room() {
    const std::array<int, 3> size = g_.room();
    const int volume = size[0] * size[1] * size[2];
    switch (kind_) {
      case Kind::lattice:
        lattice(size);
        if (beyond_ > 0) scatter(rng_.whole(20, 60), size);
        break;
      case Kind::gas:
        scatter(rng_.whole(volume / 4, volume), size);
        break;
      case Kind::crowd: {
        scatter(rng_.whole(20, 60), size);
        const Point middle = anywhere(size);
        for (int k = rng_.whole(60, 160); k > 0; --k) {
          Point p = anywhere(size);
          for (std::size_t a = 0; a < 3; ++a)
            p.x[a] = std::clamp(middle.x[a] + rng_.whole(-fine, fine), 0, fine * size[a] - 1);
          g_.points.push_back(p);
        }
        break;
      }
      case Kind::coincident:
        scatter(rng_.whole(20, volume / 2), size);
        for (int k = rng_.whole(1, 6); k > 0; --k) {
          Point twin = g_.points[static_cast<std::size_t>(rng_.whole(0, static_cast<int>(g_.points.size()) - 1))];
          twin.v = anywhere(size).v;
          g_.points.push_back(twin);
        }
        break;
      case Kind::cell_faces: {
        const int H = fine * (16 + g_.support) / 10;
        scatter(rng_.whole(volume / 4, volume / 2), size);
        for (Point& p : g_.points)
          for (std::size_t a = 0; a < 3; ++a)
            if (rng_.in(40)) p.x[a] = std::min(p.x[a] / H * H, fine * size[a] - 1);
        break;
      }
      case Kind::outliers:
        scatter(rng_.whole(20, volume / 2), size);
        for (int k = rng_.whole(1, 5); k > 0; --k) {
          Point p = anywhere(size);
          for (std::size_t a = 0; a < 3; ++a)
            if (!g_.periodic[a]) p.x[a] += (rng_.in(50) ? -1 : 1) * fine * rng_.whole(12, 1 << rng_.whole(4, 10));
          g_.points.push_back(p);
        }
        break;
      case Kind::few:
        scatter(rng_.whole(0, 3), size);
        break;
    }
  }

  Rng& rng_;
  Case& g_;
  Kind kind_;
  int fastest_, beyond_ = 0;
};

std::array<int, 3> draw_vector(Rng& rng, int most) {
  return {rng.whole(-most, most), rng.whole(-most, most), rng.whole(-most, most)};
}

void draw_tilt(Rng& rng, Vessel& v) {
  v.tilts = 1;
  v.axis = draw_vector(rng, 4);
  if (rng.in(30) || v.axis == std::array<int, 3>{}) v.axis = {0, 1, 0};
  if (rng.in(70)) v.pivot = draw_vector(rng, rng.in(50) ? 6 : 40);
  v.angle = rng.whole(-16, 16);
  v.start = rng.whole(-30, 2);
  // Pauses and reversals too.
  for (int k = rng.whole(0, 5); k > 0; --k) v.steps.push_back({rng.whole(2, 24), rng.in(20) ? 0 : rng.whole(-48, 48)});
  if (rng.in(25)) v.rate = rng.whole(-24, 24);
  if (rng.in(25)) v.tilt_oscillation = {{rng.whole(-24, 24), 0, 0}, rng.whole(16, 200), rng.whole(-25, 25)};
}

void draw_translation(Rng& rng, Vessel& v, const std::array<int, 3>& along) {
  const auto speed = [&](int most) {
    std::array<int, 3> drawn = draw_vector(rng, most);
    for (std::size_t a = 0; a < 3; ++a) drawn[a] *= along[a];
    return drawn;
  };
  v.translates = 1;
  v.translation_start = rng.whole(-30, 2);
  for (int k = rng.whole(0, 4); k > 0; --k)
    v.translation_steps.push_back({rng.whole(2, 24), rng.in(20) ? std::array<int, 3>{} : speed(24)});
  if (rng.in(40)) v.velocity = speed(16);
  if (rng.in(40)) v.translation_oscillation = {speed(16), rng.whole(16, 200), rng.whole(-25, 25)};
}

Vessel draw_vessel(Rng& rng, bool revolved, int smallest, int largest) {
  Vessel v;
  v.form =
      static_cast<Form>(revolved ? rng.whole(3, 6) : std::array{0, 0, 1, 2}[static_cast<std::size_t>(rng.whole(0, 3))]);
  if (v.form == Form::plug && rng.in(50)) v.form = Form::cup;
  for (int& s : v.size) s = rng.whole(smallest, largest);
  if (rng.in(30)) v.belt = draw_vector(rng, 8);
  return v;
}

/// A period of three supports at least.
int period(Rng& rng, const Case& g, int drawn) {
  return std::max(drawn, (3 * (16 + g.support) + 9) / 10 + (rng.in(40) ? rng.whole(0, 2) : 0));
}

void draw_vessels(Rng& rng, Case& g) {
  const bool open = rng.in(12), revolved = rng.in(45);
  const bool repeats = g.periodic != std::array<int, 3>{}, everywhere = g.periodic == std::array{1, 1, 1};
  if (open || (everywhere && !revolved)) return;
  g.vessels.push_back(draw_vessel(rng, revolved, 4, 7));
  // Boxes span periods, and nothing but them has room then.
  if (repeats && !revolved) {
    for (std::size_t a = 0; a < 3; ++a)
      if (g.periodic[a]) g.vessels[0].size[a] = period(rng, g, g.vessels[0].size[a]);
    if (rng.in(20)) draw_translation(rng, g.vessels[0], {1 - g.periodic[0], 1 - g.periodic[1], 1 - g.periodic[2]});
    return;
  }
  for (int more = rng.in(25) ? rng.in(30) ? 2 : 1 : 0; more > 0; --more) {
    Vessel v = draw_vessel(rng, repeats || rng.in(50), 2, 4);
    v.side = rng.whole(0, 5);
    v.gap = rng.in(30) ? 0 : rng.whole(0, 24);
    v.shift = {rng.whole(-2, 2), rng.whole(-2, 2)};
    g.vessels.push_back(v);
  }
  for (Vessel& v : g.vessels) {
    if (!repeats && rng.in(45)) draw_tilt(rng, v);
    if (rng.in(20)) draw_translation(rng, v, {1, 1, 1});
  }
  g.reversed = g.vessels.size() > 1 && rng.in(50);
}

}  // namespace

Case random_case(std::uint64_t seed) {
  Rng rng(seed);
  Case g;
  const Kind kind = kind_of(rng);
  g.kernel = rng.whole(0, 2);
  // H is a whole number of lattice points for three ratios only.
  g.support =
      kind == Kind::cell_faces ? std::array{4, 9, 14}[static_cast<std::size_t>(rng.whole(0, 2))] : rng.whole(2, 12);
  if (rng.in(50)) g.mass = rng.whole(-20, 20);
  if (rng.in(50)) g.rest_density = rng.whole(-9, 126);
  if (rng.in(50)) g.sound_speed = rng.whole(-8, 40);
  g.linear_state = rng.in(50);
  g.tension = rng.in(50);
  g.viscosity = rng.in(20) ? 0 : rng.whole(1, 50);
  g.wall_viscosity = rng.in(20) ? 0 : rng.whole(1, 100);
  if (rng.in(60)) g.gravity = rng.in(25) ? std::array<int, 3>{} : draw_vector(rng, 1500);
  g.restitution = rng.in(50) ? 0 : rng.whole(1, 10);
  g.friction = rng.in(50) ? 0 : rng.whole(1, 10);
  g.contact = rng.whole(-5, 5);
  g.scale = rng.whole(-2, 4);
  g.far = rng.in(60) ? 0 : rng.whole(1, 4);
  if (rng.in(50)) g.offset = draw_vector(rng, 3);
  for (int& s : g.size) s = rng.whole(4, 7);
  g.layers = rng.whole(1, 3);
  if (rng.in(50))
    for (int& p : g.periodic) p = rng.in(40);
  for (std::size_t a = 0; a < 3; ++a)
    if (g.periodic[a]) g.size[a] = period(rng, g, g.size[a]);
  draw_vessels(rng, g);
  g.floor = !g.periodic[2] && rng.in(30);
  if (g.floor && rng.in(60)) g.floor_gap = rng.whole(0, 24);
  g.substep = rng.in(5) ? 0 : rng.whole(0, 999);
  g.courant = rng.whole(1, 4);
  g.frames = rng.whole(1, 20);
  Scattering(rng, g, kind).draw();
  return g;
}

}  // namespace decant::fuzz
