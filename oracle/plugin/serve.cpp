/// \file
/// Does with a plug-in's table what is asked over a socket. Arrays that a plug-in writes are fenced: what it writes
/// beyond them is an error of the call.
#include "oracle/plugin/serve.hpp"

#include "oracle/plugin/field_table.hpp"
#include "oracle/plugin/flat_scene.hpp"
#include "oracle/plugin/message.hpp"
#include "reference/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace decant {
namespace {

using plugin::Code;
using plugin::Packer;
using plugin::Unpacker;

[[noreturn]] void fail(const std::string& why) { throw std::runtime_error(why); }

/// Values of a plug-in's to write, between values that it must not.
template <class T>
class Fenced {
 public:
  Fenced(const char* name, std::size_t size, T unwritten) : name_(name), values_(size + 2 * fence, mark()) {
    std::fill_n(data(), size, unwritten);
  }
  T* data() { return values_.data() + fence; }
  void require_whole() const {
    const auto same = [](T value) {
      return std::bit_cast<std::uint64_t>(value) == std::bit_cast<std::uint64_t>(mark());
    };
    if (!std::all_of(values_.begin(), values_.begin() + fence, same)) fail(fmt::format("wrote before {}", name_));
    if (!std::all_of(values_.end() - fence, values_.end(), same)) fail(fmt::format("wrote beyond {}", name_));
  }
  void pack_into(Packer& out) const {
    const std::uint64_t size = values_.size() - 2 * fence;
    out(size);
    out.raw(values_.data() + fence, size * sizeof(T));
  }

 private:
  static constexpr std::ptrdiff_t fence = 64;
  static T mark() { return std::bit_cast<T>(std::uint64_t{0x7ff7dec0de0dec0d}); }
  const char* name_;
  std::vector<T> values_;
};

class Host {
 public:
  explicit Host(const OpenPlugin& opened) : table_(opened.table), solver_(opened.solver) {}
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host() { table_.destroy(solver_); }

  std::string introduction() const {
    Packer out;
    out(table_.offers);
    std::string name = table_.name, precision = table_.precision ? table_.precision : "",
                device = table_.device && table_.device(solver_) ? table_.device(solver_) : "";
    for (std::string* text : {&name, &precision, &device}) pack(out, *text);
    return out.bytes;
  }

  std::string answer(const plugin::Message& request) {
    Unpacker in(request.bytes);
    Packer out;
    switch (request.code) {
      case Code::load:
        load(in);
        break;
      case Code::evaluate:
        evaluate(in, out);
        break;
      case Code::advance:
        advance(in, out);
        break;
      case Code::read:
        read(out);
        break;
      case Code::lists:
        lists(out);
        break;
      case Code::stage_times:
        stage_times(out);
        break;
      default:
        fail("an unknown request");
    }
    return out.bytes;
  }

 private:
  void call(int status) const {
    if (status == 0) return;
    const char* why = table_.last_error(solver_);
    fail(why && *why ? why : fmt::format("failed with {}", status));
  }

  void load(Unpacker& in) {
    in(scene_);
    std::vector<Container> containers(static_cast<std::size_t>(scene_.containers));
    for (Container& container : containers) pack(in, container);
    callbacks_ = SceneCallbacks(std::move(containers));
    callbacks_.attach(scene_);
    pack(in, wall_position_);
    pack(in, wall_container_);
    in(state_.substep);
    pack(in, state_.position);
    pack(in, state_.velocity);
    const decant_walls walls{sizeof walls, 0, wall_position_.cols(), wall_position_.data(), wall_container_.data()};
    const decant_state state{sizeof state,          0, state_.size(), state_.substep, state_.position.data(),
                             state_.velocity.data()};
    call(table_.load(solver_, &scene_, &walls, &state));
  }

  void evaluate(Unpacker& in, Packer& out) {
    if (!table_.evaluate) fail("does not offer to evaluate");
    bool is_given = false;
    in(is_given);
    StageInputs inputs;
    for (auto* values : {&inputs.boundary_volume, &inputs.density, &inputs.pressure}) pack(in, *values);
    const auto or_null = [](const Eigen::VectorXd& v) { return v.size() > 0 ? v.data() : nullptr; };
    const decant_given given{sizeof given, 0, or_null(inputs.boundary_volume), or_null(inputs.density),
                             or_null(inputs.pressure)};
    const auto n = static_cast<std::size_t>(state_.size()), m = static_cast<std::size_t>(wall_position_.cols());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    decant_fields fields{};
    fields.size = sizeof fields;
    fields.fluid = state_.size();
    fields.walls = wall_position_.cols();
    std::vector<Fenced<double>> reals;
    for (const plugin::RealField& field : plugin::real_fields)
      fields.*field.theirs = reals.emplace_back(field.name, field.size(n, m), nan).data();
    std::vector<Fenced<std::int64_t>> counts;
    for (const plugin::CountField& field : plugin::count_fields)
      fields.*field.theirs = counts.emplace_back(field.name, n, -1).data();
    decant_status status = no_trouble();
    call(table_.evaluate(solver_, is_given ? &given : nullptr, &fields, &status));
    for (const auto& values : reals) values.require_whole();
    for (const auto& values : counts) values.require_whole();
    tell(status, out);
    for (const auto& values : reals) values.pack_into(out);
    for (const auto& values : counts) values.pack_into(out);
    out(held());
  }

  void advance(Unpacker& in, Packer& out) {
    std::int64_t substeps = 0;
    in(substeps);
    decant_status status = no_trouble();
    call(table_.advance(solver_, substeps, &status));
    tell(status, out);
    out(held());
  }

  void read(Packer& out) {
    if (!table_.read) fail("does not offer to read the state");
    const auto n = 3 * static_cast<std::size_t>(state_.size());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Fenced<double> position("position", n, nan), velocity("velocity", n, nan);
    call(table_.read(solver_, position.data(), velocity.data()));
    for (const auto* values : {&position, &velocity}) {
      values->require_whole();
      values->pack_into(out);
    }
  }

  void lists(Packer& out) {
    if (!table_.lists) fail("does not offer its lists");
    decant_lists lists{};
    lists.size = sizeof lists;
    lists.built = -1;
    call(table_.lists(solver_, &lists));
    out(lists.built);
    pack_lists("fluid", lists.fluid_offsets, lists.fluid, out);
    pack_lists("wall", lists.wall_offsets, lists.wall, out);
  }
  void pack_lists(const char* name, const std::int64_t* offsets, const std::int32_t* entries, Packer& out) const {
    const auto n = static_cast<std::size_t>(state_.size());
    if (!offsets) fail(fmt::format("gave no {}_offsets", name));
    if (offsets[0] != 0) fail(fmt::format("{}_offsets begin with {}; 0", name, offsets[0]));
    for (std::size_t i = 0; i < n; ++i)
      if (offsets[i + 1] < offsets[i])
        fail(fmt::format("{}_offsets of particle {} go from {} to {}", name, i, offsets[i], offsets[i + 1]));
    if (offsets[n] > 0 && !entries) fail(fmt::format("gave no list {}", name));
    std::vector<std::int64_t> starts(offsets, offsets + n + 1);
    std::vector<std::int32_t> values(entries, entries + offsets[n]);
    pack(out, starts);
    pack(out, values);
  }

  void stage_times(Packer& out) const {
    decant_stage_times times{};
    times.size = sizeof times;
    if (table_.stage_times) call(table_.stage_times(solver_, &times));
    out(times);
  }

  static decant_status no_trouble() { return {sizeof(decant_status), 0, -1, -1}; }
  static void tell(const decant_status& status, Packer& out) {
    out(status.bits);
    out(status.particle);
    out(status.substep);
  }
  std::int64_t held() const { return table_.bytes ? table_.bytes(solver_) : 0; }

  decant_plugin_table table_;
  void* solver_;
  decant_scene scene_{};
  SceneCallbacks callbacks_;
  Eigen::Matrix3Xd wall_position_;
  std::vector<std::int32_t> wall_container_;
  ParticleState state_;
};

}  // namespace

void serve_plugin(int socket, const std::function<OpenPlugin()>& open) {
  std::unique_ptr<Host> host;
  const auto answered = [&](auto&& work) {
    try {
      plugin::send(socket, {Code::done, work()});
      return true;
    } catch (const plugin::Silence&) {
      throw;
    } catch (const std::exception& error) {
      plugin::send(socket, {Code::failed, error.what()});
    } catch (...) {
      plugin::send(socket, {Code::failed, "threw what is no std::exception"});
    }
    return false;
  };
  try {
    const bool ready = answered([&] {
      host = std::make_unique<Host>(open());
      return host->introduction();
    });
    while (ready) {
      const plugin::Message request = plugin::receive(socket, {});
      (void)answered([&] { return host->answer(request); });
    }
  } catch (const plugin::Silence&) {  // nobody asks any more
  }
}

}  // namespace decant
