"""Who answers: scripted, through a queue, or from a record. The agent never imports this folder."""
