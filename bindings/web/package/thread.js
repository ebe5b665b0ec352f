/* A thread beside worker.js: one more instance of the module on the same memory, which runs the library's tasks until the Worker ends. */
import { Module } from './core.js';
import { listen, port } from '#port';

listen(port, 'message', ({ compiled, thread }) => {
  const module = new Module(compiled, thread);
  port.postMessage('ready');
  module.exports.web_join_team();
});
