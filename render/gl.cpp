#include "render/gl.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "render/error.h"

namespace offstage::render::gl {
namespace {

std::string info_log(GLuint object, PFNGLGETSHADERIVPROC query, PFNGLGETSHADERINFOLOGPROC read) {
  GLint length = 0;
  query(object, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
  read(object, static_cast<GLsizei>(log.size()), nullptr, log.data());
  return log.c_str();
}

void attach_shader(GLuint program, GLenum stage, std::span<const std::string_view> files,
                   std::span<const std::string> defines) {
  std::string text = "#version 450 core\n";
  if (stage == GL_FRAGMENT_SHADER) text += "#define FRAGMENT 1\n";
  for (const std::string& define : defines) text += "#define " + define + "\n";
  for (const std::string_view file : files) text.append(shader_source(file));

  const GLuint shader = glCreateShader(stage);
  const char* source = text.c_str();
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  const std::string log = ok ? std::string() : info_log(shader, glGetShaderiv, glGetShaderInfoLog);
  glAttachShader(program, shader);
  glDeleteShader(shader);  // OpenGL deletes the shader together with the program
  if (!ok) throw UnavailableError("shader " + std::string(files.back()) + " does not compile: " + log);
}

}  // namespace

Buffer make_buffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return Buffer(name);
}

VertexArray make_vertex_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return VertexArray(name);
}

namespace {

constexpr GLsizei kMostPending = 8192;

/// Waits until all draws of this thread's context are done whenever kMostPending triangles were drawn since
/// the last time. `triangles`: number of triangles that were drawn now.
void finish_triangles(GLsizei triangles) {
  thread_local GLsizei pending = 0;
  pending += triangles;
  if (pending < kMostPending) return;
  glFinish();
  pending = 0;
}

}  // namespace

void draw_triangles(GLsizei index_count, GLsizei instances, GLuint first) {
  const GLsizei triangles = index_count / 3, part = std::min(triangles, kMostPending);
  const GLsizei together = std::max(kMostPending / std::max(triangles, 1), 1);
  for (GLsizei i = 0; i < instances; i += together) {
    const GLsizei copies = std::min(together, instances - i);
    for (GLsizei from = 0; from < triangles; from += part) {
      const GLsizei count = std::min(part, triangles - from);
      const auto offset_bytes = static_cast<std::uintptr_t>(3 * from) * sizeof(GLuint);
      glDrawElementsInstancedBaseInstance(GL_TRIANGLES, 3 * count, GL_UNSIGNED_INT,
                                          reinterpret_cast<const void*>(offset_bytes), copies,
                                          first + static_cast<GLuint>(i));
      finish_triangles(count * copies);
    }
  }
}

void draw_quads(GLsizei count, GLuint first) {
  constexpr GLsizei kTogether = kMostPending / 2;
  for (GLsizei from = 0; from < count; from += kTogether) {
    const GLsizei drawn = std::min(kTogether, count - from);
    glDrawArraysInstancedBaseInstance(GL_TRIANGLE_STRIP, 0, 4, drawn, first + static_cast<GLuint>(from));
    finish_triangles(2 * drawn);
  }
}

Texture make_target(GLenum format, int width_px, int height_px, GLenum filter) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  Texture texture(name);
  glTextureStorage2D(texture, 1, format, width_px, height_px);
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

Framebuffer make_framebuffer(GLuint color, GLuint depth) {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  Framebuffer framebuffer(name);
  if (color != 0) {
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, color, 0);
  } else {
    glNamedFramebufferDrawBuffer(framebuffer, GL_NONE);
    glNamedFramebufferReadBuffer(framebuffer, GL_NONE);
  }
  if (depth != 0) glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, depth, 0);
  const GLenum status = glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    if (status == 0) throw UnavailableError("no GL context is current on this thread");
    throw UnavailableError("GL framebuffer is not complete (status " + std::to_string(status) +
                           "): the size may exceed the limit of this driver");
  }
  return framebuffer;
}

void StreamBuffer::write(const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  if (buffer_ == 0 || bytes > capacity_) {
    capacity_ = std::max(bytes, 2 * capacity_);
    buffer_ = make_buffer();
    glNamedBufferData(buffer_, static_cast<GLsizeiptr>(capacity_), nullptr, GL_STREAM_DRAW);
  }
  glNamedBufferSubData(buffer_, 0, static_cast<GLsizeiptr>(bytes), data);
}

void set_attribute(GLuint vertex_array, GLuint attribute, GLuint binding, int components,
                   std::size_t offset) {
  glEnableVertexArrayAttrib(vertex_array, attribute);
  glVertexArrayAttribFormat(vertex_array, attribute, components, GL_FLOAT, GL_FALSE,
                            static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(vertex_array, attribute, binding);
}

Program make_program(std::span<const std::string_view> vertex, std::span<const std::string_view> fragment,
                     std::span<const std::string> defines) {
  Program program(glCreateProgram());
  attach_shader(program, GL_VERTEX_SHADER, vertex, defines);
  if (!fragment.empty()) attach_shader(program, GL_FRAGMENT_SHADER, fragment, defines);
  glLinkProgram(program);
  GLint ok = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (!ok) {
    throw UnavailableError("shader program " + std::string(vertex.back()) +
                           " does not link: " + info_log(program, glGetProgramiv, glGetProgramInfoLog));
  }
  return program;
}

namespace {

thread_local SharedPrograms* thread_programs = nullptr;  // a thread has one context

}  // namespace

SharedPrograms::SharedPrograms() {
  thread_programs = this;
}

SharedPrograms::~SharedPrograms() {
  thread_programs = nullptr;
}

GLuint shared_program(std::span<const std::string_view> vertex, std::span<const std::string_view> fragment,
                      std::span<const std::string> defines) {
  std::string key;
  for (const std::string_view file : vertex) key.append(file).append(" ");
  key += "| ";
  for (const std::string_view file : fragment) key.append(file).append(" ");
  for (const std::string& define : defines) key += "| " + define;
  auto& programs = thread_programs->programs_;
  const auto known = programs.find(key);
  if (known != programs.end()) return known->second;
  return programs.emplace(key, make_program(vertex, fragment, defines)).first->second;
}

void check_error(const char* where) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw UnavailableError("GL error " + std::to_string(error) + " in " + where +
                         (error == GL_OUT_OF_MEMORY ? ": out of memory" : ""));
}

}  // namespace offstage::render::gl
