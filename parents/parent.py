"""Who may stand behind the agent's mailbox: a script, people through a database, or a record.

parents.scripted.ScriptedParent   answers in tensors, one tick later (Eq. 7, 8)
server.queue.queue_parent.QueueParent          answers through the database
parents.replay.ReplayParent       gives a recorded session back
"""

from __future__ import annotations

from parenting.agent.mailbox import Mailbox as Parent

__all__ = ["Parent"]
