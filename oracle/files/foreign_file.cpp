/// \file
/// The process that rewrites, what it copies, and what it says.
#include "oracle/files/foreign_file.hpp"

#include "oracle/files/hdf5_checked.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace decant {
namespace {

constexpr int deepest = 3;  // STATE/fields/NAME

/// What the process says in the end: as it is, rewritten, or refused with key, value and bound.
enum class Said : char { as_it_is = '=', rewritten = '>', refused = '!' };

/// A numeric type, in this machine's byte order.
Handle number_type(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return Handle(kind == H5T_INTEGER || kind == H5T_FLOAT ? H5Tget_native_type(type, H5T_DIR_ASCEND) : -1);
}

class Rewriter {
 public:
  explicit Rewriter(const std::filesystem::path& file) : in_(file, Hdf5Reader::Format::any) {}

  /// Whether any attribute is a string of variable length.
  bool has_variable_strings(const std::string& group = "/", int depth = 0) const {
    if (of_object(group)) return true;
    for (const std::string& path : objects_in(group))
      if (is_group(path) ? depth < deepest && has_variable_strings(path, depth + 1) : of_object(path)) return true;
    return false;
  }
  bool has_checksums() const { return in_.has_checksums(); }

  void write(const std::filesystem::path& copy) const {
    Hdf5Writer out(copy, 0);
    copy_group("/", 0, out);
    out.commit();
  }

 private:
  std::vector<std::string> objects_in(const std::string& group) const {
    std::vector<std::string> paths;
    for (const std::string& name : in_.children(group)) {
      const std::string path = (group == "/" ? "" : group) + "/" + name;
      H5L_info_t link;
      if (H5Lget_info(in_.id(), path.c_str(), &link, H5P_DEFAULT) >= 0 && link.type == H5L_TYPE_HARD)
        paths.push_back(path);
    }
    return paths;
  }
  H5I_type_t kind_of(const std::string& path) const {
    return H5Iget_type(hdf5::open_object(in_, in_.id(), path).get());
  }
  bool is_group(const std::string& path) const { return kind_of(path) == H5I_GROUP; }

  bool of_object(const std::string& path) const {
    const Handle object = hdf5::open_object(in_, in_.id(), path);
    for (const std::string& name : in_.attribute_names(path)) {
      const Handle attribute(H5Aopen(object.get(), name.c_str(), H5P_DEFAULT));
      if (hdf5::is_variable_string(Handle(H5Aget_type(attribute.get())).get())) return true;
    }
    return false;
  }

  void copy_group(const std::string& group, int depth, Hdf5Writer& out) const {
    out.group(group);
    copy_attributes(group, out);
    for (const std::string& path : objects_in(group)) {
      const H5I_type_t kind = kind_of(path);
      if (kind == H5I_GROUP && depth < deepest) copy_group(path, depth + 1, out);
      if (kind == H5I_DATASET && copy_dataset(path, depth, out)) copy_attributes(path, out);
    }
  }

  /// False where it is left out, as one of another kind beside the groups is.
  bool copy_dataset(const std::string& path, int depth, Hdf5Writer& out) const {
    const Handle object = hdf5::open_object(in_, in_.id(), path);
    const Handle type(H5Dget_type(object.get())), native = number_type(type.get());
    const std::vector<std::int64_t> shape = in_.shape(path);
    if (!native) {
      if (depth == 0) return false;
      in_.fail(path, hdf5::describe(type.get(), {shape.begin(), shape.end()}), "numbers");
    }
    const hdf5::Dataset data =
        hdf5::open_dataset(in_, in_.id(), path, H5Tget_class(type.get()), shape.size(), -1, hdf5::Extents::any);
    std::vector<char> values(data.count * H5Tget_size(native.get()));
    hdf5::read_all(in_, path, data, native.get(), values.data());
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    const Handle made = make_dataset(out.id(), path, native.get(), data.dims, creation);
    if (!made ||
        (data.count > 0 && H5Dwrite(made.get(), native.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0))
      throw std::runtime_error(path + ": " + hdf5_message());
    return true;
  }

  void copy_attributes(const std::string& path, Hdf5Writer& out) const {
    const Handle object = hdf5::open_object(in_, in_.id(), path);
    for (const std::string& name : in_.attribute_names(path)) {
      const Handle attribute(H5Aopen(object.get(), name.c_str(), H5P_DEFAULT));
      const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
      if (!attribute || H5Sget_simple_extent_npoints(space.get()) != 1) continue;
      if (hdf5::is_variable_string(type.get())) {
        char* text = nullptr;
        if (H5Aread(attribute.get(), type.get(), &text) < 0)
          in_.fail(hdf5::attribute_key(path, name), hdf5_message(), "readable; the file is damaged");
        out.attribute(path, name, std::string(text ? text : ""));
        H5free_memory(text);
      } else if (H5Tget_class(type.get()) == H5T_STRING) {
        out.attribute(path, name, in_.text_attribute(path, name));
      } else if (const Handle native = number_type(type.get())) {
        std::array<char, 32> value{};  // no number is longer
        if (H5Tget_size(native.get()) > value.size() || H5Aread(attribute.get(), native.get(), value.data()) < 0 ||
            !write_attribute(out.id(), path, name, native.get(), native.get(), value.data()))
          in_.fail(hdf5::attribute_key(path, name), hdf5_message(), "readable; the file is damaged");
      }
    }
  }

  Hdf5Reader in_;
};

std::string rewritten(const std::filesystem::path& file, const std::filesystem::path& copy) {
  const auto refused = [](const std::string& key, const std::string& value, const std::string& bound) {
    return static_cast<char>(Said::refused) + key + '\0' + value + '\0' + bound;
  };
  try {
    const Rewriter rewriter(file);
    if (rewriter.has_checksums() && !rewriter.has_variable_strings()) return {static_cast<char>(Said::as_it_is)};
    rewriter.write(copy);
    return {static_cast<char>(Said::rewritten)};
  } catch (const InputError& error) {
    return refused(error.key(), error.value(), error.bound());
  } catch (const std::exception& error) {
    return refused("file", error.what(), "an HDF5 file that can be rewritten");
  }
}

/// What the process said, and the status that it ended with; its life ends here.
std::pair<std::string, int> heard_from(pid_t child, int pipe, std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  std::string said;
  for (std::array<char, 4096> buffer{};;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    pollfd ready{pipe, POLLIN, 0};
    const int answer = left.count() > 0 ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
    if (answer < 0 && errno == EINTR) continue;
    const ssize_t size = answer > 0 ? read(pipe, buffer.data(), buffer.size()) : 0;
    if (answer <= 0) kill(child, SIGKILL);
    if (size <= 0) break;
    said.append(buffer.data(), static_cast<std::size_t>(size));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  return {said, status};
}

}  // namespace

Hdf5Reader open_foreign(const std::filesystem::path& file, std::chrono::milliseconds limit) {
  std::error_code ignored;
  // What is no file at all is told by the reader.
  if (!std::filesystem::is_regular_file(file, ignored)) return Hdf5Reader(file);
  const TemporaryFolder folder;
  const std::filesystem::path copy = folder / "copy.h5";
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe for a process that reads " + file.string());
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process that reads " + file.string());
  if (child == 0) {
    // Nothing of the parent's may run on here: neither its handlers nor what it would do at exit.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int signal : {SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
    const std::string said = rewritten(file, copy);
    const bool told = write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size());
    _exit(told ? 0 : 1);
  }
  close(ends[1]);
  const auto [said, status] = heard_from(child, ends[0], limit);
  close(ends[0]);
  const auto kind = said.empty() ? Said::refused : static_cast<Said>(said.front());
  if (kind == Said::rewritten && WIFEXITED(status) && WEXITSTATUS(status) == 0)
    return Hdf5Reader(copy, Hdf5Reader::Format::checksums, file);
  if (kind == Said::as_it_is) return Hdf5Reader(file);
  if (said.empty()) {
    const bool late = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
    const std::string how = late ? fmt::format("not read within {:g} s", 1e-3 * static_cast<double>(limit.count()))
                            : WIFSIGNALED(status) ? fmt::format("its reader was ended by signal {}", WTERMSIG(status))
                                                  : "its reader gave up";
    throw InputError(file.string(), "file", how, "a whole HDF5 file");
  }
  const std::size_t first = said.find('\0'), second = said.find('\0', first + 1);
  throw InputError(file.string(), said.substr(1, first - 1), said.substr(first + 1, second - first - 1),
                   said.substr(second + 1));
}

}  // namespace decant
