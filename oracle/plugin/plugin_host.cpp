/// \file
/// The process of a plug-in: opens the library, checks its table, and does what is asked over socket 3.
///   decant-plugin-host LIBRARY OPTIONS
/// Arrays that a plug-in writes are fenced: what it writes beyond them is an error of the call.
#include "oracle/plugin.h"
#include "oracle/plugin/message.hpp"
#include "reference/distance.hpp"
#include "reference/pose.hpp"
#include "reference/state.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace decant {
namespace {

using plugin::Code;
using plugin::Packer;
using plugin::Unpacker;

constexpr int socket_fd = 3;

[[noreturn]] void fail(const std::string& why) { throw std::runtime_error(why); }

/// A plug-in's table as far as both know it, the rest null. Throws where it is none of ours.
decant_plugin_table table_of(const std::string& library) {
  void* handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) fail(fmt::format("is no library that can be loaded: {}", ::dlerror()));
  const auto entry = reinterpret_cast<decltype(&decant_plugin)>(::dlsym(handle, "decant_plugin"));
  if (!entry) fail("exports no function decant_plugin (oracle/plugin.h)");
  const decant_plugin_table* given = entry(DECANT_PLUGIN_ABI);
  if (!given) fail(fmt::format("does not work with ABI {}", DECANT_PLUGIN_ABI));
  if (given->abi != DECANT_PLUGIN_ABI)
    fail(fmt::format("is built for ABI {}; this program has {}", given->abi, DECANT_PLUGIN_ABI));
  decant_plugin_table table{};
  constexpr std::uint32_t least = offsetof(decant_plugin_table, device);
  if (given->size < least) fail(fmt::format("has a table of {} bytes; at least {} are needed", given->size, least));
  std::memcpy(&table, given, std::min<std::size_t>(given->size, sizeof table));
  const auto need = [&](bool there, const char* what) {
    if (!there) fail(fmt::format("has no {}", what));
  };
  need(table.name && *table.name, "name");
  need(table.create && table.destroy && table.load && table.last_error, "create, destroy, load or last_error");
  constexpr std::uint32_t fields = DECANT_OFFERS_DENSITY | DECANT_OFFERS_ACCELERATION | DECANT_OFFERS_PARTS |
                                   DECANT_OFFERS_NEIGHBORS | DECANT_OFFERS_GIVEN | DECANT_OFFERS_BOUNDARY_VOLUME;
  need(!(table.offers & fields) || table.evaluate, "evaluate, which its offers need");
  need(!(table.offers & DECANT_OFFERS_STEP) || (table.advance && table.read), "advance or read, which its offers need");
  return table;
}

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

/// In the order of the answer.
struct RealField {
  const char* name;
  double* decant_fields::* member;
  std::size_t components;
};
constexpr RealField real_fields[] = {
    {"boundary_volume", &decant_fields::boundary_volume, 1},
    {"density", &decant_fields::density, 1},
    {"pressure", &decant_fields::pressure, 1},
    {"acceleration", &decant_fields::acceleration, 3},
    {"pressure_acceleration", &decant_fields::pressure_acceleration, 3},
    {"viscous_acceleration", &decant_fields::viscous_acceleration, 3},
    {"wall_pressure_acceleration", &decant_fields::wall_pressure_acceleration, 3},
    {"wall_viscous_acceleration", &decant_fields::wall_viscous_acceleration, 3},
};
struct CountField {
  const char* name;
  std::int64_t* decant_fields::* member;
};
constexpr CountField count_fields[] = {
    {"fluid_neighbor_count", &decant_fields::fluid_neighbor_count},
    {"fluid_neighbor_id_sum", &decant_fields::fluid_neighbor_id_sum},
    {"wall_neighbor_count", &decant_fields::wall_neighbor_count},
    {"wall_neighbor_id_sum", &decant_fields::wall_neighbor_id_sum},
};

class Host {
 public:
  Host(const std::string& library, const std::string& options) : table_(table_of(library)) {
    call(table_.create(options.c_str(), &solver_));
  }
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
    containers_.assign(static_cast<std::size_t>(scene_.containers), {});
    solids_.clear();
    for (Container& container : containers_) {
      pack(in, container);
      solids_.emplace_back(container);
    }
    pack(in, wall_position_);
    pack(in, wall_container_);
    in(state_.substep);
    pack(in, state_.position);
    pack(in, state_.velocity);
    scene_.host = this;
    scene_.pose = [](const void* host, std::int32_t k, double time, decant_pose* out) {
      static_cast<const Host*>(host)->pose(k, time, *out);
    };
    scene_.distance = [](const void* host, std::int32_t k, const double* point, double* normal) {
      const SurfaceDistance found =
          static_cast<const Host*>(host)->solids_.at(static_cast<std::size_t>(k)).at(Eigen::Map<const Vec3>(point));
      if (normal) std::copy_n(found.normal.data(), 3, normal);
      return found.distance;
    };
    const decant_walls walls{sizeof walls, 0, wall_position_.cols(), wall_position_.data(), wall_container_.data()};
    const decant_state state{sizeof state,          0, state_.size(), state_.substep, state_.position.data(),
                             state_.velocity.data()};
    call(table_.load(solver_, &scene_, &walls, &state));
  }

  void pose(std::int32_t k, double time, decant_pose& out) const {
    const Pose pose = pose_at(containers_.at(static_cast<std::size_t>(k)), time);
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation = pose.rotation;
    std::copy_n(rotation.data(), 9, out.rotation);
    std::copy_n(pose.translation.data(), 3, out.translation);
    std::copy_n(pose.pivot.data(), 3, out.pivot);
    std::copy_n(pose.angular_velocity.data(), 3, out.angular_velocity);
    std::copy_n(pose.linear_velocity.data(), 3, out.linear_velocity);
    std::copy_n(pose.surface_velocity.data(), 3, out.surface_velocity);
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
    for (const RealField& field : real_fields) {
      const std::size_t size = field.member == &decant_fields::boundary_volume ? m : field.components * n;
      fields.*field.member = reals.emplace_back(field.name, size, nan).data();
    }
    std::vector<Fenced<std::int64_t>> counts;
    for (const CountField& field : count_fields) fields.*field.member = counts.emplace_back(field.name, n, -1).data();
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

  static decant_status no_trouble() { return {sizeof(decant_status), 0, -1, -1}; }
  static void tell(const decant_status& status, Packer& out) {
    out(status.bits);
    out(status.particle);
    out(status.substep);
  }
  std::int64_t held() const { return table_.bytes ? table_.bytes(solver_) : 0; }

  decant_plugin_table table_;
  void* solver_ = nullptr;
  decant_scene scene_{};
  std::vector<Container> containers_;
  std::vector<SolidDistance> solids_;
  Eigen::Matrix3Xd wall_position_;
  std::vector<std::int32_t> wall_container_;
  ParticleState state_;
};

int serve(const std::string& library, const std::string& options) {
  std::unique_ptr<Host> host;
  const auto answered = [&](auto&& work) {
    try {
      plugin::send(socket_fd, {Code::done, work()});
      return true;
    } catch (const plugin::Silence&) {
      throw;
    } catch (const std::exception& error) {
      plugin::send(socket_fd, {Code::failed, error.what()});
    } catch (...) {
      plugin::send(socket_fd, {Code::failed, "threw what is no std::exception"});
    }
    return false;
  };
  const bool ready = answered([&] {
    host = std::make_unique<Host>(library, options);
    return host->introduction();
  });
  while (ready) {
    const plugin::Message request = plugin::receive(socket_fd, {});
    (void)answered([&] { return host->answer(request); });
  }
  return 0;
}

}  // namespace
}  // namespace decant

int main(int count, char** arguments) {
  if (count != 3) return 2;
  try {
    return decant::serve(arguments[1], arguments[2]);
  } catch (const decant::plugin::Silence&) {
    return 0;  // nobody asks any more
  }
}
