// Runs a fuzz target on random mutations of its corpus, without guidance by coverage: for compilers without
// libFuzzer, so that every test run has some hundred thousand such inputs in the sanitized build.
//   usage: TARGET SECONDS CORPUS_FOLDER FAILING_INPUT [SEED]
// The same seed gives the same inputs. An input that takes over a minute of processor time ends the process
// with SIGPROF. The input that is running is in the file FAILING_INPUT, which stays there if the process ends
// early and is removed otherwise.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

using Bytes = std::vector<uint8_t>;

constexpr std::size_t kMostBytes = 1 << 16;
constexpr itimerval kMostTime = {{0, 0}, {60, 0}};

class Mutator {
 public:
  Mutator(std::vector<Bytes> corpus, uint64_t seed) : corpus_(std::move(corpus)), random_(seed) {}

  Bytes next() {
    Bytes bytes = any();
    for (std::size_t left = 1 + below(8); left > 0; --left) mutate(bytes);
    bytes.resize(std::min(bytes.size(), kMostBytes));
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return n > 0 ? random_() % n : 0; }
  const Bytes& any() { return corpus_[below(corpus_.size())]; }

  void mutate(Bytes& bytes) {
    switch (below(7)) {
      case 0:
        if (!bytes.empty()) bytes[below(bytes.size())] ^= static_cast<uint8_t>(1 << below(8));
        break;
      case 1: {
        static constexpr uint8_t kValues[] = {0,   1,   0x7f, 0x80, 0xff, '"', '{',
                                              '}', '[', ',',  '-',  '9',  'e', '\\'};
        if (!bytes.empty()) bytes[below(bytes.size())] = kValues[below(std::size(kValues))];
        break;
      }
      case 2: {  // random bytes
        Bytes more(1 + below(16));
        for (uint8_t& byte : more) byte = static_cast<uint8_t>(random_());
        insert(bytes, more);
        break;
      }
      case 3: {
        const std::size_t from = below(bytes.size()), count = below(bytes.size() - from + 1);
        const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(from);
        bytes.erase(first, first + static_cast<std::ptrdiff_t>(std::min<std::size_t>(count, 64)));
        break;
      }
      case 4:
        insert(bytes, part_of(bytes));
        break;
      case 5:
        insert(bytes, part_of(any()));
        break;
      default: {  // a number in binary
        static constexpr double kNumbers[] = {0,    -0.0, 1,     1e-320, 1e-30, 1e30,
                                              1e39, 1e80, 1e154, 1e300,  -1e300};
        const double number = kNumbers[below(std::size(kNumbers))];
        const uint64_t count = uint64_t{1} << below(64);
        const bool is_count = below(2) == 0;
        if (bytes.size() < sizeof number) break;
        std::memcpy(bytes.data() + below(bytes.size() - sizeof number + 1),
                    is_count ? static_cast<const void*>(&count) : &number, sizeof number);
      }
    }
  }

  Bytes part_of(const Bytes& bytes) {
    const std::size_t from = below(bytes.size()), count = below(bytes.size() - from + 1);
    const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(from);
    return {first, first + static_cast<std::ptrdiff_t>(count)};
  }
  void insert(Bytes& bytes, const Bytes& more) {
    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() + 1)), more.begin(),
                 more.end());
  }

  std::vector<Bytes> corpus_;
  std::mt19937_64 random_;
};

std::vector<Bytes> read_corpus(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Bytes> corpus;
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return corpus;
}

/// A file with the current input, which remains if the process crashes.
class RunningInput {
 public:
  explicit RunningInput(const char* path) : path_(path), fd_(::open(path, O_RDWR | O_CREAT | O_TRUNC, 0600)) {
    if (fd_ >= 0) memory_ = ::mmap(nullptr, kMostBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
    if (memory_ == MAP_FAILED) {
      std::perror(path);
      std::exit(2);
    }
  }
  ~RunningInput() { ::unlink(path_); }

  void set(const Bytes& bytes) {
    if (::ftruncate(fd_, static_cast<off_t>(bytes.size())) != 0) std::abort();
    if (!bytes.empty()) std::memcpy(memory_, bytes.data(), bytes.size());
  }

 private:
  const char* path_;
  int fd_;
  void* memory_ = MAP_FAILED;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: %s SECONDS CORPUS_FOLDER FAILING_INPUT [SEED]\n", argv[0]);
    return 2;
  }
  Mutator mutator(read_corpus(argv[2]), argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1);
  RunningInput running(argv[3]);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::atoi(argv[1]));
  uint64_t runs = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs) {
    const Bytes input = mutator.next();
    running.set(input);
    ::setitimer(ITIMER_PROF, &kMostTime, nullptr);
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  std::printf("%llu inputs\n", static_cast<unsigned long long>(runs));
}
