"""Contact of the body with itself and with the floor: lips, pieces, and what lies on the table."""
