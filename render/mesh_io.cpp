#include "render/mesh_io.h"

#include <algorithm>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/child_process.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/mesh_import.h"

// assimp overflows its stack, loops, or allocates what a header claims on files that any fuzzer finds within
// minutes. So a forked child imports, under limits of time and memory, and hands the model over in a memory
// file. Only that child can crash, and the caller gets a message.

namespace offstage::render {
namespace {

constexpr uint64_t kMaxMeshBytes = uint64_t{2} << 30;
constexpr rlim_t kMaxMemoryBytes = rlim_t{4} << 30;  // beyond what the process has mapped already
constexpr int kModelExit = 40, kMessageExit = 41;    // other codes are not the child's

/// Calls `archive` for all that a model holds: the same list for writing and reading.
template <class Archive>
void transfer(Archive& archive, Model& model) {
  archive.list(model.parts, [&](Model::Part& part) {
    archive.value(part.material);
    archive.array(part.mesh.positions);
    archive.array(part.mesh.normals);
    archive.array(part.mesh.uvs);
    archive.array(part.mesh.indices);
  });
  archive.list(model.nodes, [&](Model::Node& node) {
    archive.array(node.name);
    archive.value(node.parent);
    archive.value(node.position);
    archive.value(node.orientation.coeffs());
  });
  archive.list(model.materials, [&](Material& m) {
    archive.array(m.name);
    archive.value(m.color);
    archive.value(m.metallic);
    archive.value(m.roughness);
    archive.value(m.emission);
    archive.value(m.two_sided);
    archive.value(m.base_color_texture);
    archive.value(m.metallic_roughness_texture);
    archive.value(m.emission_texture);
  });
  archive.list(model.textures, [&](Image& image) {
    archive.value(image.width_px);
    archive.value(image.height_px);
    archive.array(image.rgba);
  });
  archive.list(model.warnings, [&](std::string& line) { archive.array(line); });
}

class Writer {
 public:
  explicit Writer(int fd) : fd_(fd) {}

  template <class T>
  void value(const T& value) {
    bytes(&value, sizeof value);
  }
  template <class Container>
  void array(const Container& values) {
    value(uint64_t{values.size()});
    bytes(values.data(), values.size() * sizeof values[0]);
  }
  template <class T, class Each>
  void list(std::vector<T>& values, Each each) {
    value(uint64_t{values.size()});
    for (T& element : values) each(element);
  }

 private:
  void bytes(const void* data, std::size_t size) {
    if (write_all(fd_, {static_cast<const uint8_t*>(data), size}) != 0) throw std::bad_alloc();
  }
  int fd_;
};

/// Believes no count: the child may have been damaged before it wrote.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : rest_(bytes) {}

  template <class T>
  void value(T& value) {
    std::memcpy(static_cast<void*>(&value), take(sizeof value), sizeof value);
  }
  template <class Container>
  void array(Container& values) {
    constexpr std::size_t kSize = sizeof(typename Container::value_type);
    values.resize(count(kSize));
    if (!values.empty())
      std::memcpy(static_cast<void*>(values.data()), take(values.size() * kSize), values.size() * kSize);
  }
  template <class T, class Each>
  void list(std::vector<T>& values, Each each) {
    values.resize(count(1));
    for (T& element : values) each(element);
  }

 private:
  std::size_t count(std::size_t element_size) {
    uint64_t n = 0;
    value(n);
    if (n > rest_.size() / element_size) throw FileError("the model reader gave a damaged answer");
    return n;
  }
  const uint8_t* take(std::size_t size) {
    if (size > rest_.size()) throw FileError("the model reader gave a damaged answer");
    const uint8_t* data = rest_.data();
    rest_ = rest_.subspan(size);
    return data;
  }
  std::span<const uint8_t> rest_;
};

/// A memory file's contents, mapped.
class Mapping {
 public:
  explicit Mapping(int fd) : size_(static_cast<std::size_t>(std::max<off_t>(::lseek(fd, 0, SEEK_END), 0))) {
    if (size_ == 0) return;
    data_ = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0);
    if (data_ == MAP_FAILED) throw std::bad_alloc();
  }
  ~Mapping() {
    if (size_ > 0) ::munmap(data_, size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  std::span<const uint8_t> bytes() const { return {static_cast<const uint8_t*>(data_), size_}; }

 private:
  std::size_t size_;
  void* data_ = nullptr;
};

/// 8 s of processor time and 1 s more for each MiB, six times that by the clock, 4 GiB of memory; quietly.
void limit_this_process(uint64_t file_bytes) {
  const rlim_t seconds = 8 + (file_bytes >> 20);
  const auto limit = [](__rlimit_resource what, rlim_t value) {
    const rlimit both{value, value};
    ::setrlimit(what, &both);
  };
  uint64_t mapped_pages = 0;
  std::ifstream("/proc/self/statm") >> mapped_pages;
  limit(RLIMIT_AS, mapped_pages * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE)) + kMaxMemoryBytes);
  limit(RLIMIT_CPU, seconds);
  limit(RLIMIT_CORE, 0);

  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGALRM, SIGXCPU}) ::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM}) ::signal(signal, SIG_IGN);  // our caller decides
  ::alarm(static_cast<unsigned>(6 * seconds));
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);

  const int nowhere = ::open("/dev/null", O_RDWR);  // assimp's own prints
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, stream);
}

/// The child: leaves a model or a message in the memory file.
[[noreturn]] void import_and_exit(const std::filesystem::path& path, const std::string& node,
                                  uint64_t file_bytes, int memory) {
  std::string message;
  try {
    limit_this_process(file_bytes);
    Model model = import_model(path, node);
    Writer writer(memory);
    transfer(writer, model);
    ::_exit(kModelExit);
  } catch (const FileError& error) {
    message = error.what();
  } catch (const std::bad_alloc&) {
    message = path.string() + ": needs more than 4 GiB of memory; it is broken or too large";
  } catch (const std::exception& error) {
    message = path.string() + ": cannot be read as a model: " + one_line(error.what());
  }
  write_all(memory, {reinterpret_cast<const uint8_t*>(message.data()), message.size()});
  ::_exit(kMessageExit);
}

int wait_status(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw UnavailableError("the model reader was lost: " + system_reason(errno));
  }
  return status;
}

[[noreturn]] void throw_for_crash(const std::filesystem::path& path, int status) {
  const bool slow = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM ||
                                            WTERMSIG(status) == SIGKILL);
  throw FileError(path.string() +
                  (slow ? ": takes too long or too much memory to read; it is broken or too large"
                        : ": crashed the model reader (" + describe_failure(status).value_or("ended") +
                              "); it is broken or nested too deeply"));
}

uint64_t checked_size(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw FileError(path.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(path.string() + ": is not a regular file");
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) throw FileError(path.string() + ": cannot be read: " + error.message());
  if (size == 0) throw FileError(path.string() + ": is empty");
  if (size > kMaxMeshBytes) throw FileError(path.string() + ": is larger than 2 GiB");
  return size;
}

}  // namespace

ModelPath split_node(const std::filesystem::path& path) {
  const std::string text = path.string();
  const std::size_t mark = text.rfind('#');
  std::error_code error;
  if (mark == std::string::npos || std::filesystem::exists(path, error)) return {path, ""};
  return {text.substr(0, mark), text.substr(mark + 1)};
}

Model read_model(const std::filesystem::path& file) {
  const auto [path, node] = split_node(file);
  const uint64_t size = checked_size(path);
  const Descriptor memory(::memfd_create("offstage-model", MFD_CLOEXEC));
  if (!memory) throw UnavailableError("no memory file for the model reader: " + system_reason(errno));
  const pid_t child = ::fork();
  if (child < 0) throw UnavailableError("the model reader cannot be started: " + system_reason(errno));
  if (child == 0) import_and_exit(path, node, size, memory.fd());

  const int status = wait_status(child);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  if (code != kModelExit && code != kMessageExit) throw_for_crash(path, status);
  const Mapping answer(memory.fd());
  if (code == kMessageExit) throw FileError({answer.bytes().begin(), answer.bytes().end()});

  Model model;
  Reader reader(answer.bytes());
  transfer(reader, model);
  for (Model::Part& part : model.parts) {
    if (part.mesh.normals.empty()) compute_normals(part.mesh);
  }
  return model;
}

}  // namespace offstage::render
