"""What is added to the commands of the cascade. One compensation, one file; core only."""
