#include "channel.hh"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <thread>

namespace frobs
{
Channel::Channel(int _socket) : socket(_socket)
{
  std::thread([_socket]
  {
    pollfd watched{_socket, POLLRDHUP, 0};
    while (poll(&watched, 1, -1) < 0 && errno == EINTR) {}
    _exit(0);  // the client has ended; a busy server would not notice
  }).detach();
}

Op Channel::Receive(std::string &_body)
{
  uint32_t size;
  uint8_t op;
  this->Read(reinterpret_cast<char *>(&size), sizeof(size));
  this->Read(reinterpret_cast<char *>(&op), sizeof(op));
  _body.resize(size);
  this->Read(&_body[0], size);
  return static_cast<Op>(op);
}

void Channel::Send(uint8_t _verdict, const std::string &_body)
{
  Writer frame;
  frame.Put(static_cast<uint32_t>(_body.size()));
  frame.Put(_verdict);
  frame.data += _body;
  size_t sent = 0;
  while (sent < frame.data.size())
  {
    const ssize_t n = ::send(this->socket, frame.data.data() + sent, frame.data.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      _exit(0);
    sent += n;
  }
}

void Channel::Read(char *_into, size_t _size)
{
  while (_size > 0)
  {
    const ssize_t n = ::recv(this->socket, _into, _size, 0);
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      _exit(0);
    _into += n;
    _size -= n;
  }
}
}
