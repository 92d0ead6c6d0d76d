/// \file
/// Lays the frame file out with HDF5, then writes to it with plain system calls.
#include "tools/frames/frame_file.hpp"

#include "oracle/files/hdf5_handle.hpp"
#include "reference/error.hpp"
#include "reference/pose.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <system_error>

namespace decant::frames {

// Values go to the file as they lie in memory.
static_assert(std::endian::native == std::endian::little);

namespace {

struct DatasetPlan {
  std::string path;
  std::vector<hsize_t> shape;
  hid_t type;
  std::string unit, description;

  std::uint64_t bytes() const {
    std::uint64_t n = H5Tget_size(type);
    for (hsize_t extent : shape) n *= extent;
    return n;
  }
};

std::string vertex_path(const RenderWall& wall) { return "/walls/" + wall.name + "/vertex"; }
std::string triangle_path(const RenderWall& wall) { return "/walls/" + wall.name + "/triangle"; }

std::vector<DatasetPlan> plan(const Layout& layout) {
  const hsize_t t = static_cast<hsize_t>(layout.frames);
  const hsize_t n = static_cast<hsize_t>(layout.particles);
  const hid_t f32 = H5T_IEEE_F32LE, f64 = H5T_IEEE_F64LE, u8 = H5T_STD_U8LE, i32 = H5T_STD_I32LE;
  std::vector<DatasetPlan> plans = {
      {"/time", {t}, f64, "s", "time of each frame; NaN where it has not been written yet"},
      {"/fluid/position", {t, n, 3}, f32, "m", "frame, particle, x y z"},
      {"/fluid/velocity", {t, n, 3}, f32, "m/s", "frame, particle, x y z"},
      {"/fluid/density", {t, n}, f32, "kg/m³", "frame, particle"},
      {"/fluid/pressure", {t, n}, f32, "Pa", "frame, particle"},
      {"/fluid/place", {t, n}, u8, "", "frame, particle; 0 source, 1 in flight, 2 receiver, 3 spilled, 4 lost"},
  };
  for (const RenderWall& wall : layout.walls) {
    const hsize_t v = static_cast<hsize_t>(wall.surface.vertex.cols());
    if (wall.moving) plans.push_back({vertex_path(wall), {t, v, 3}, f32, "m", "frame, vertex, x y z; world"});
    else plans.push_back({vertex_path(wall), {v, 3}, f32, "m", "vertex, x y z; world"});
    plans.push_back({triangle_path(wall), {wall.surface.triangle.size(), 3}, i32, "", "triangle, its three vertices"});
  }
  return plans;
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw std::runtime_error(file.string() + ": " + what);
}

[[noreturn]] void fail_errno(const std::filesystem::path& file, const char* what) {
  fail(file, fmt::format("{}: {}", what, std::generic_category().message(errno)));
}

/// The type of a text in this file, which ends with NUL.
Handle text_type(const std::string& text) { return utf8_type(text.size() + 1, H5T_STR_NULLTERM); }

void put_text(hid_t file, const std::string& object, const std::string& name, const std::string& text) {
  const Handle type = text_type(text);
  if (!write_attribute(file, object, name, type.get(), type.get(), text.c_str()))
    throw std::runtime_error("attribute " + name + ": " + hdf5_message());
}

/// The scene goes into a dataset, because an attribute holds 64 kB at most.
void put_scene(hid_t file, const Scene& scene) {
  const std::string text = scene_to_json(scene);
  const Handle type = text_type(text);
  const Handle dataset = make_dataset(file, "/scene", type.get(), {}, Handle(H5Pcreate(H5P_DATASET_CREATE)));
  if (!dataset || H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) < 0)
    throw std::runtime_error("dataset /scene: " + hdf5_message());
}

/// Gives a dataset its place in the file, and returns where that begins.
std::uint64_t lay_out(hid_t file, const DatasetPlan& d) {
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_layout(creation.get(), H5D_CONTIGUOUS);
  H5Pset_alloc_time(creation.get(), H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
  const Handle dataset = make_dataset(file, d.path, d.type, d.shape, creation);
  if (!dataset) throw std::runtime_error("dataset " + d.path + ": " + hdf5_message());
  if (!d.unit.empty()) put_text(file, d.path, "unit", d.unit);
  put_text(file, d.path, "description", d.description);
  const haddr_t offset = H5Dget_offset(dataset.get());
  if (offset == HADDR_UNDEF && d.bytes() > 0)
    throw std::runtime_error("dataset " + d.path + ": has no place in the file");
  return offset;
}

/// Opens for writing, making the file where it is missing and changing nothing in it, and keeps other
/// pours out until this one ends, however it ends. The kind of lock is not HDF5's own, so readers are let
/// in.
int open_exclusively(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) fail_errno(file, "cannot be opened");
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  struct stat own{}, named{};
  const bool taken = ::fcntl(descriptor, F_OFD_SETLK, &lock) != 0 && (errno == EAGAIN || errno == EACCES);
  // Whoever had it before may have given the file its final name meanwhile.
  const bool gone = ::fstat(descriptor, &own) != 0 || ::stat(file.c_str(), &named) != 0 || own.st_ino != named.st_ino ||
                    own.st_dev != named.st_dev;
  if (!taken && !gone) return descriptor;
  ::close(descriptor);
  throw InputError(file.string(), "frames", "in use", "another pour is writing this file");
}

std::uint64_t find_dataset(hid_t file, const std::filesystem::path& name, const DatasetPlan& d) {
  const Handle dataset(H5Dopen2(file, d.path.c_str(), H5P_DEFAULT));
  if (!dataset) throw InputError(name.string(), d.path, "missing", "a frame file of the same scene is needed");
  const Handle space(H5Dget_space(dataset.get())), type(H5Dget_type(dataset.get()));
  std::vector<hsize_t> shape(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
  H5Sget_simple_extent_dims(space.get(), shape.data(), nullptr);
  if (shape != d.shape || H5Tequal(type.get(), d.type) <= 0)
    throw InputError(name.string(), d.path, fmt::format("[{}]", fmt::join(shape, ", ")),
                     fmt::format("must be [{}] to be continued", fmt::join(d.shape, ", ")));
  return H5Dget_offset(dataset.get());
}

/// Access without file locks, which some network file systems do not have.
Handle without_locks() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_file_locking(access.get(), false, true);
  silence_hdf5();
  return access;
}

template <class T>
std::size_t byte_count(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

Layout layout_of(const Scene& scene, std::int64_t particles) {
  Layout layout;
  layout.particles = particles;
  layout.frames = scene.schedule.frames + 1;
  for (const Container& container : scene.containers)
    layout.walls.push_back({container.name, moves(container), render_surface(container, scene.particle_spacing)});
  return layout;
}

std::vector<float> posed_vertices(const Container& container, const RenderSurface& surface, double time) {
  const Pose pose = pose_at(container, time);
  std::vector<float> world(3 * static_cast<std::size_t>(surface.vertex.cols()));
  Eigen::Map<Eigen::Matrix3Xf> out(world.data(), 3, surface.vertex.cols());
  out = ((pose.rotation * surface.vertex).colwise() + pose.translation).cast<float>();
  return world;
}

std::int64_t file_bytes(const Layout& layout) {
  std::uint64_t bytes = 0;
  for (const DatasetPlan& d : plan(layout)) bytes += d.bytes();
  return static_cast<std::int64_t>(bytes);
}

File::File(std::filesystem::path file, const Layout& layout)
    : file_(std::move(file)), particles_(layout.particles), frames_(layout.frames) {
  for (const RenderWall& wall : layout.walls)
    if (wall.moving) moving_.push_back(vertex_path(wall));
}

File::File(File&& other) noexcept
    : file_(std::move(other.file_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      particles_(other.particles_),
      frames_(other.frames_),
      offset_(std::move(other.offset_)),
      moving_(std::move(other.moving_)) {}

File::~File() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

File File::create(const std::filesystem::path& file, const Scene& scene, const Layout& layout,
                  const std::map<std::string, std::string>& texts) {
  File out(file, layout);
  // Before HDF5 empties it.
  out.descriptor_ = open_exclusively(file);
  try {
    const Handle access = without_locks();
    const Handle id = create_file(file.string(), access);
    if (!id) throw std::runtime_error("cannot be created: " + hdf5_message());
    for (const auto& [name, text] : texts) put_text(id.get(), "/", name, text);
    put_scene(id.get(), scene);
    for (const DatasetPlan& d : plan(layout)) out.offset_[d.path] = lay_out(id.get(), d);
  } catch (const std::runtime_error& error) {
    fail(file, error.what());
  }
  // Reserves the room, so that the disk cannot fill up under a running pour. Not every file system
  // can; then only the estimate stands between the pour and a full disk.
  const off_t size = ::lseek(out.descriptor_, 0, SEEK_END);
  if (::fallocate(out.descriptor_, 0, 0, size) != 0 && errno != EOPNOTSUPP && errno != ENOSYS)
    fail_errno(file, "no room");

  const std::vector<double> unwritten(static_cast<std::size_t>(layout.frames),
                                      std::numeric_limits<double>::quiet_NaN());
  out.put(out.offset_.at("/time"), unwritten.data(), byte_count(unwritten), 0);
  for (std::size_t c = 0; c < layout.walls.size(); ++c) {
    const RenderWall& wall = layout.walls[c];
    const auto& triangle = wall.surface.triangle;
    out.put(out.offset_.at(triangle_path(wall)), triangle.data(), byte_count(triangle), 0);
    if (wall.moving) continue;
    const auto vertex = posed_vertices(scene.containers.at(c), wall.surface, 0.0);
    out.put(out.offset_.at(vertex_path(wall)), vertex.data(), byte_count(vertex), 0);
  }
  out.sync();
  return out;
}

File File::reopen(const std::filesystem::path& file, const Layout& layout) {
  File out(file, layout);
  {
    const Handle access = without_locks();
    const Handle id(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access.get()));
    if (!id) throw InputError(file.string(), "frames", hdf5_message(), "a checkpoint continues this file");
    for (const DatasetPlan& d : plan(layout)) out.offset_[d.path] = find_dataset(id.get(), file, d);
  }
  out.descriptor_ = open_exclusively(file);
  return out;
}

void File::put(std::uint64_t dataset_offset, const void* data, std::size_t bytes, std::int64_t row) {
  auto* from = static_cast<const char*>(data);
  auto at = static_cast<off_t>(dataset_offset + static_cast<std::uint64_t>(row) * bytes);
  while (bytes > 0) {
    const ssize_t done = ::pwrite(descriptor_, from, bytes, at);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) fail_errno(file_, "cannot be written");
    from += done;
    at += done;
    bytes -= static_cast<std::size_t>(done);
  }
}

template <class T>
void File::put_row(const std::string& path, const std::vector<T>& values, std::int64_t row) {
  const std::uint64_t offset = offset_.at(path);
  put(offset, values.data(), byte_count(values), row);
  // The kernel would begin to write once much has gathered, and the end of the pour would wait for that. Where it
  // does not take the hint nothing is lost.
  (void)::sync_file_range(descriptor_,
                          static_cast<off_t>(offset + static_cast<std::uint64_t>(row) * byte_count(values)),
                          static_cast<off_t>(byte_count(values)), SYNC_FILE_RANGE_WRITE);
}

void File::require(bool fits, const Frame& frame) const {
  if (!fits || frame.index < 0 || frame.index >= frames_)
    fail(file_, fmt::format("frame {} does not fit its layout", frame.index));
}

void File::write(const Frame& frame) {
  write_values(frame);
  complete(frame);
}

void File::write_values(const Frame& frame) {
  const auto n = static_cast<std::size_t>(particles_);
  require(frame.position.size() == 3 * n && frame.velocity.size() == 3 * n && frame.density.size() == n &&
              frame.pressure.size() == n && frame.wall.size() == moving_.size(),
          frame);
  put_row("/fluid/position", frame.position, frame.index);
  put_row("/fluid/velocity", frame.velocity, frame.index);
  put_row("/fluid/density", frame.density, frame.index);
  put_row("/fluid/pressure", frame.pressure, frame.index);
  for (std::size_t w = 0; w < moving_.size(); ++w) put_row(moving_[w], frame.wall[w], frame.index);
}

void File::complete(const Frame& frame) {
  require(frame.place.size() == static_cast<std::size_t>(particles_), frame);
  put_row("/fluid/place", frame.place, frame.index);
  put(offset_.at("/time"), &frame.time, sizeof frame.time, frame.index);
}

void File::sync() {
  if (::fdatasync(descriptor_) != 0) fail_errno(file_, "cannot be synchronised");
}

}  // namespace decant::frames
