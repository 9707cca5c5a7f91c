#pragma once
/// Private: owning wrappers of GL names, and programs built from the embedded shaders. GL is used only in the
/// .cpp files of render/.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glad/gl.h>

namespace offstage::render {

/// Returns the text of a file of shaders/ (see cmake/embed_shaders.cmake).
std::string_view shader_source(std::string_view name);

namespace gl {

/// Owns one GL name, created and deleted by Traits; 0 when empty.
template <class Traits>
class Object {
 public:
  Object() = default;
  explicit Object(GLuint name) : name_(name) {}
  ~Object() {
    if (name_ != 0) Traits::destroy(name_);
  }
  Object(Object&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  operator GLuint() const { return name_; }

 private:
  GLuint name_ = 0;
};

struct BufferTraits {
  static void destroy(GLuint name) { glDeleteBuffers(1, &name); }
};
struct TextureTraits {
  static void destroy(GLuint name) { glDeleteTextures(1, &name); }
};
struct FramebufferTraits {
  static void destroy(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct VertexArrayTraits {
  static void destroy(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct ProgramTraits {
  static void destroy(GLuint name) { glDeleteProgram(name); }
};
using Buffer = Object<BufferTraits>;
using Texture = Object<TextureTraits>;
using Framebuffer = Object<FramebufferTraits>;
using VertexArray = Object<VertexArrayTraits>;
using Program = Object<ProgramTraits>;

Buffer make_buffer();
VertexArray make_vertex_array();
/// Creates an immutable buffer.
template <class T>
Buffer make_buffer(std::span<const T> values) {
  Buffer buffer = make_buffer();
  glNamedBufferStorage(buffer, static_cast<GLsizeiptr>(values.size_bytes()), values.data(), 0);
  return buffer;
}
/// Returns a 2D texture of one level, clamped to its edges.
Texture make_target(GLenum format, int width_px, int height_px, GLenum filter);
/// Creates a framebuffer. Throws UnavailableError if it is not complete. A texture of 0 leaves that
/// attachment empty.
Framebuffer make_framebuffer(GLuint color, GLuint depth);

/// A buffer that is rewritten each frame. It grows but never shrinks.
class StreamBuffer {
 public:
  template <class T>
  void write(std::span<const T> values) {
    write(values.data(), values.size_bytes());
  }
  operator GLuint() const { return buffer_; }

 private:
  void write(const void* data, std::size_t bytes);
  Buffer buffer_;
  std::size_t capacity_ = 0;
};

/// Sets the format of one float attribute of a vertex array, which is read from the buffer at `binding`.
/// `offset`: in a vertex [bytes].
void set_attribute(GLuint vertex_array, GLuint attribute, GLuint binding, int components, std::size_t offset);

/// Draws `instances` copies of an indexed mesh of triangles with the bound vertex array, from instance
/// `first` on. Large draws are split, and the parts are waited for, because llvmpipe stores all triangles
/// that it has not drawn yet, in up to 36 MB.
void draw_triangles(GLsizei index_count, GLsizei instances = 1, GLuint first = 0);
/// Draws the instances `first` ... `first + count - 1` of a strip of four vertices, split as above.
void draw_quads(GLsizei count, GLuint first = 0);

/// Links a program. Each stage is a list of files of shaders/ joined in order behind #version and `defines`
/// ("NAME value" each); an empty fragment list means depth only. Throws UnavailableError with the compiler's
/// log.
Program make_program(std::span<const std::string_view> vertex, std::span<const std::string_view> fragment,
                     std::span<const std::string> defines = {});

/// Returns a program built as above, once for the context of this thread, and shared by all stages. Compiling
/// a program takes longer than a frame. Callers set all uniforms before each draw, because other stages
/// change them.
GLuint shared_program(std::span<const std::string_view> vertex, std::span<const std::string_view> fragment,
                      std::span<const std::string> defines = {});

/// Owns the programs built by shared_program() on this thread, during its lifetime. Each context has one.
class SharedPrograms {
 public:
  SharedPrograms();
  ~SharedPrograms();
  SharedPrograms(const SharedPrograms&) = delete;
  SharedPrograms& operator=(const SharedPrograms&) = delete;

 private:
  friend GLuint shared_program(std::span<const std::string_view> vertex,
                               std::span<const std::string_view> fragment,
                               std::span<const std::string> defines);
  std::map<std::string, Program> programs_;
};

/// A program that is built on first use, so that start-up builds only the programs a scene needs.
class LazyProgram {
 public:
  LazyProgram(std::vector<std::string_view> vertex, std::vector<std::string_view> fragment,
              std::vector<std::string> defines = {})
      : vertex_(std::move(vertex)), fragment_(std::move(fragment)), defines_(std::move(defines)) {}
  /// Makes the program current.
  void use() {
    if (program_ == 0) program_ = shared_program(vertex_, fragment_, defines_);
    glUseProgram(program_);
  }

 private:
  std::vector<std::string_view> vertex_, fragment_;
  std::vector<std::string> defines_;
  GLuint program_ = 0;
};

/// Throws UnavailableError if a GL error is pending; `where` is part of the message.
void check_error(const char* where);

}  // namespace gl
}  // namespace offstage::render
