"""The queues of the simulator, and the ages of its data, compared with queueing theory."""
